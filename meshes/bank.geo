// The soil of a slope, without the empty cells around it: quadrilaterals cut by diagonals all one way, the arrangement in
// which linear triangles lock. Lengths in m, angle in degrees.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh.
DefineConstant[ height = 1.0, angle = 45.0, crest = 1.1, divisions = 4 /* over the height; 3/2 times as many along the base */ ];
base = crest + height / Tan(angle * Pi / 180);

Point(1) = {0, 0, 0};
Point(2) = {base, 0, 0};
Point(3) = {crest, height, 0};
Point(4) = {0, height, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve{1, 3} = Ceil(1.5 * divisions) + 1;
Transfinite Curve{2, 4} = divisions + 1;
Transfinite Surface{1} Right;

Physical Surface("soil", 1) = {1};
Physical Curve("left", 1) = {4};
Physical Curve("base", 2) = {1};
Physical Curve("slope", 5) = {2};
Physical Curve("crest", 6) = {3};
