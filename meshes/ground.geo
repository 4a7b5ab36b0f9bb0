// Half of a strip footing on the ground, in equal squares cut by diagonals all one way, the arrangement in which linear
// triangles lock: the axis of symmetry is x = 0, the ground's surface y = 0. Lengths in m.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh.
DefineConstant[
  half_width = 1.0,             // of the footing
  beside = 3, below = 2,        // ground beside and below the footing, in half widths
  divisions = 4                 // squares below half of the footing
];

Point(1) = {0, 0, 0};
Point(2) = {half_width, 0, 0};
Point(3) = {(1 + beside) * half_width, 0, 0};
Point(4) = {(1 + beside) * half_width, -below * half_width, 0};
Point(5) = {half_width, -below * half_width, 0};
Point(6) = {0, -below * half_width, 0};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {6, 1, 7, 5};
Curve Loop(2) = {-7, 2, 3, 4};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Curve{1, 5} = divisions + 1;
Transfinite Curve{2, 4} = beside * divisions + 1;
Transfinite Curve{3, 6, 7} = below * divisions + 1;
Transfinite Surface{1} = {6, 5, 2, 1} Right;
Transfinite Surface{2} = {5, 4, 3, 2} Right;

Physical Surface("soil", 1) = {1, 2};
Physical Curve("axis", 1) = {6};
Physical Curve("base", 2) = {4, 5};
Physical Curve("far", 3) = {3};
Physical Curve("surface", 4) = {2};
Physical Curve("footing", 5) = {1};
