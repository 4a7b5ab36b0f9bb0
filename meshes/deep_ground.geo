// Half of a strip footing on deep ground, with the ground near the footing as a soil of its own: the axis of symmetry is
// x = 0, the ground's surface y = 0.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  half_width = 1.0,  // of the footing
  width = 20.0, depth = 10.0,
  reach = 5.0, deep = 4.0,  // of the ground near the footing
  near_size = 0.25,  // of the cells there
  far_size = 2.0     // of those at the far corner
];

Point(1) = {0, 0, 0, near_size};
Point(2) = {half_width, 0, 0, near_size};
Point(3) = {reach, 0, 0, near_size};
Point(4) = {reach, -deep, 0, near_size};
Point(5) = {0, -deep, 0, near_size};
Point(6) = {width, 0, 0, far_size};
Point(7) = {width, -depth, 0, far_size};
Point(8) = {0, -depth, 0, far_size};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Line(6) = {3, 6};
Line(7) = {6, 7};
Line(8) = {7, 8};
Line(9) = {8, 5};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};
Curve Loop(2) = {6, 7, 8, 9, -4, -3};
Plane Surface(2) = {2};

Physical Surface("near", 1) = {1};
Physical Surface("far", 2) = {2};
Physical Curve("axis", 1) = {5, 9};
Physical Curve("base", 2) = {8};
Physical Curve("side", 3) = {7};
Physical Curve("surface", 4) = {2, 6};
Physical Curve("footing", 5) = {1};
Physical Curve("border", 6) = {3, 4};
