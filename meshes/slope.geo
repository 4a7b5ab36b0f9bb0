// Background mesh of a slope: soil before failure (1) and empty cells (2), one conforming mesh.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m, angle in degrees.
DefineConstant[
  height = 1.0, angle = 45.0, crest = 1.1,
  runout = 2.0,    // length of the background past the toe
  headroom = 0.1,  // height of the background above the crest
  cell_size = 0.1
];
base = crest + height / Tan(angle * Pi / 180);

Point(1) = {0, 0, 0, cell_size};
Point(2) = {base, 0, 0, cell_size};
Point(3) = {crest, height, 0, cell_size};
Point(4) = {0, height, 0, cell_size};
Point(5) = {base + runout, 0, 0, cell_size};
Point(6) = {base + runout, height + headroom, 0, cell_size};
Point(7) = {0, height + headroom, 0, cell_size};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Line(5) = {2, 5};
Line(6) = {5, 6};
Line(7) = {6, 7};
Line(8) = {7, 4};

Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Curve Loop(2) = {5, 6, 7, 8, -3, -2};
Plane Surface(2) = {2};

Physical Surface("soil", 1) = {1};
Physical Surface("empty", 2) = {2};
Physical Curve("left", 1) = {4, 8};
Physical Curve("base", 2) = {1, 5};
Physical Curve("right", 3) = {6};
Physical Curve("top", 4) = {7};
Physical Curve("slope", 5) = {2};
Physical Curve("crest", 6) = {3};
