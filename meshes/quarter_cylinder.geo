// A quarter of a cylinder about the z axis, in three dimensions; its planes of symmetry are x = 0 and y = 0.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  radius = 1.0, height = 1.0,
  cell_size = 0.25
];

Point(1) = {0, 0, 0, cell_size};
Point(2) = {radius, 0, 0, cell_size};
Point(3) = {0, radius, 0, cell_size};
Line(1) = {1, 2};
Circle(2) = {2, 1, 3};
Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3};
Plane Surface(1) = {1};
out[] = Extrude {0, 0, height} { Surface{1}; };

Physical Volume("soil", 1) = {out[1]};
Physical Surface("base", 1) = {1};
Physical Surface("top", 2) = {out[0]};
Physical Surface("y = 0", 3) = {out[2]};
Physical Surface("wall", 4) = {out[3]};
Physical Surface("x = 0", 5) = {out[4]};
