// Cook's membrane: clamped edge (1), loaded edge (2). Lengths in m (mm in the literature; only ratios matter).
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh.
DefineConstant[ divisions = 8 ];

Point(1) = {0, 0, 0};
Point(2) = {48, 44, 0};
Point(3) = {48, 60, 0};
Point(4) = {0, 44, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
// All diagonals one way, the arrangement in which linear triangles lock.
Transfinite Curve{1, 2, 3, 4} = divisions + 1;
Transfinite Surface{1} Right;

Physical Surface("body", 1) = {1};
Physical Curve("clamped", 1) = {4};
Physical Curve("loaded", 2) = {2};
