// A standing column of soil in three dimensions: base (1), sides normal to x (2) and to y (3), top (4).
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[ height = 1.0, width = 0.5, cell_size = 0.25 ];

Point(1) = {0, 0, 0, cell_size};
Point(2) = {width, 0, 0, cell_size};
Point(3) = {width, width, 0, cell_size};
Point(4) = {0, width, 0, cell_size};
For i In {1 : 4}
  Line(i) = {i, i % 4 + 1};
EndFor
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
// The sides in the order of the lines: y = 0, x = width, y = width, x = 0; then the body.
body[] = Extrude {0, 0, height} { Surface{1}; };

Physical Volume("soil", 1) = {body[1]};
Physical Surface("base", 1) = {1};
Physical Surface("sides_x", 2) = {body[3], body[5]};
Physical Surface("sides_y", 3) = {body[2], body[4]};
Physical Surface("top", 4) = {body[0]};
