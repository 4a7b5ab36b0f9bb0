// Half of a strip footing on the ground: the axis of symmetry is x = 0, the ground's surface y = 0.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  half_width = 0.5,  // of the footing
  width = 6.0, depth = 3.0,
  edge_size = 0.02,  // of the cells at the edge of the footing, where the stress jumps
  cell_size = 0.1,
  near_size = cell_size,  // of the cells under and beside the footing
  far_size = 0.6
];

Point(1) = {0, 0, 0, near_size};
Point(2) = {half_width, 0, 0, edge_size};
Point(3) = {width, 0, 0, far_size};
Point(4) = {width, -depth, 0, far_size};
Point(5) = {0, -depth, 0, far_size};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};

Physical Surface("soil", 1) = {1};
Physical Curve("axis", 1) = {5};
Physical Curve("base", 2) = {4};
Physical Curve("far", 3) = {3};
Physical Curve("surface", 4) = {2};
Physical Curve("footing", 5) = {1};
