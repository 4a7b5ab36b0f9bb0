// A quarter of a disc about the origin: half section of one half of a ball, whose axis is x = 0, or a quarter of a cylinder.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[ radius = 1.0, cell_size = 0.1 ];

Point(1) = {0, 0, 0, cell_size};
Point(2) = {radius, 0, 0, cell_size};
Point(3) = {0, radius, 0, cell_size};
Line(1) = {1, 2};
Circle(2) = {2, 1, 3};
Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3};
Plane Surface(1) = {1};

Physical Surface("soil", 1) = {1};
Physical Curve("equator", 1) = {1};
Physical Curve("surface", 2) = {2};
Physical Curve("axis", 3) = {3};
