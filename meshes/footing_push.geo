// Half of a footing or of a cone on the ground, and the air over it, for a body that is pushed in: the axis of symmetry is x = 0, the
// ground's surface y = 0. The cells are small along the way of the footing's edge, where the stress jumps.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  half_width = 0.5,     // of the footing
  width = 2.5, depth = 1.5, headroom = 0.25,
  penetration = 0.05,   // way of the footing
  edge_size = 0.02,     // of the cells along the way of the edge
  near_size = 0.05,     // of the cells within 1.5 half widths of the edge
  far_size = 0.2
];

Point(1) = {0, -depth, 0};
Point(2) = {width, -depth, 0};
Point(3) = {0, 0, 0};
Point(4) = {width, 0, 0};
Point(5) = {0, headroom, 0};
Point(6) = {width, headroom, 0};
Line(1) = {1, 2};
Line(2) = {2, 4};
Line(3) = {4, 3};
Line(4) = {3, 1};
Line(5) = {4, 6};
Line(6) = {6, 5};
Line(7) = {5, 3};
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {-3, 5, 6, 7};
Plane Surface(1) = {1};
Plane Surface(2) = {2};

Field[1] = Box;
Field[1].VIn = edge_size;
Field[1].VOut = far_size;
Field[1].XMin = half_width - 6 * edge_size;
Field[1].XMax = half_width + 6 * edge_size;
Field[1].YMin = -penetration - 6 * edge_size;
Field[1].YMax = headroom;
Field[1].Thickness = 0.4 * half_width * (far_size - edge_size) / (near_size - edge_size + 0.5 * edge_size);
Field[2] = Box;
Field[2].VIn = near_size;
Field[2].VOut = far_size;
Field[2].XMin = 0;
Field[2].XMax = 2.5 * half_width;
Field[2].YMin = -penetration - 1.5 * half_width;
Field[2].YMax = headroom;
Field[2].Thickness = width;
Field[3] = Min;
Field[3].FieldsList = {1, 2};
Background Field = 3;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("soil", 1) = {1};
Physical Surface("air", 2) = {2};
Physical Curve("axis", 1) = {4, 7};
Physical Curve("base", 2) = {1};
Physical Curve("far", 3) = {2, 5};
