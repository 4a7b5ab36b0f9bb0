// A narrow column of a level layer of soil, 2D, diagonals all one way: the base is y = 0.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[ height = 2.0, width = 0.5, cell_size = 0.1 ];

Point(1) = {0, 0, 0};
Point(2) = {width, 0, 0};
Point(3) = {width, height, 0};
Point(4) = {0, height, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = Round(width / cell_size) + 1;
Transfinite Curve {2, 4} = Round(height / cell_size) + 1;
Transfinite Surface {1};

Physical Surface("clay", 1) = {1};
Physical Curve("base", 1) = {1};
Physical Curve("right", 2) = {2};
Physical Curve("top", 3) = {3};
Physical Curve("left", 4) = {4};
