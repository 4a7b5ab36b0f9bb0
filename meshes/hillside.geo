// The soil of a slope and of the ground below and before it, unstructured; finest at the slope.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m, angle in degrees.
DefineConstant[
  height = 1.0, angle = 45.0, crest = 1.1,
  runout = 1.0,     // length of the ground before the toe
  depth = 0.5,      // of the ground below the toe
  cell_size = 0.1,  // on the slope and its crest
  far_size = 0.2
];
base = crest + (angle < 90 ? height / Tan(angle * Pi / 180) : 0);

Point(1) = {0, -depth, 0, far_size};
Point(2) = {base + runout, -depth, 0, far_size};
Point(3) = {base + runout, 0, 0, far_size};
Point(4) = {base, 0, 0, cell_size};
Point(5) = {crest, height, 0, cell_size};
Point(6) = {0, height, 0, cell_size};

Line(1) = {6, 1};
Line(2) = {1, 2};
Line(3) = {2, 3};
Line(4) = {3, 4};
Line(5) = {4, 5};
Line(6) = {5, 6};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};

Physical Surface("soil", 1) = {1};
Physical Curve("left", 1) = {1};
Physical Curve("base", 2) = {2};
Physical Curve("right", 3) = {3};
Physical Curve("slope", 5) = {4, 5};
Physical Curve("crest", 6) = {6};
