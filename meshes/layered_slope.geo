// A slope on a foundation, two soils, unstructured; finest at the slope.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m, angle in degrees.
DefineConstant[
  height = 10.0, angle = 26.565, crest = 20.0,
  runout = 20.0,    // length of the ground before the toe
  depth = 10.0,     // of the foundation
  cell_size = 1.0,  // on the slope and its crest
  far_size = 2.0
];
toe = crest + height / Tan(angle * Pi / 180);

Point(1) = {0, -depth, 0, far_size};
Point(2) = {toe + runout, -depth, 0, far_size};
Point(3) = {toe + runout, 0, 0, far_size};
Point(4) = {toe, 0, 0, cell_size};
Point(5) = {crest, height, 0, cell_size};
Point(6) = {0, height, 0, cell_size};
Point(7) = {0, 0, 0, far_size};

Line(1) = {7, 1};
Line(2) = {1, 2};
Line(3) = {2, 3};
Line(4) = {3, 4};
Line(5) = {4, 7};
Line(6) = {4, 5};
Line(7) = {5, 6};
Line(8) = {6, 7};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};
Curve Loop(2) = {6, 7, 8, -5};
Plane Surface(2) = {2};

Physical Surface("slope", 1) = {2};
Physical Surface("foundation", 2) = {1};
Physical Curve("left", 1) = {1, 8};
Physical Curve("base", 2) = {2};
Physical Curve("right", 3) = {3};
Physical Curve("surface", 5) = {4, 6};
Physical Curve("crest", 6) = {7};
