// Half of the ground around a cone that is in it already, up to the height of its shoulder and beyond: the axis of symmetry is x = 0, the
// shoulder at y = 0. The cells are small along the way of the cone.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  radius = 0.018,     // of the cone, which has 60 degrees at its tip, and of its shaft
  tip_radius = 0.0036, // of the sphere that the tip ends in
  above = 0.072,      // height of the ground above the shoulder
  penetration = 0.1,  // way of the cone
  below = 0.3,        // depth of the ground below the way of the tip
  width = 0.54,       // radius of the ground
  cell_size = 0.003,  // beside the way of the shoulder
  near_size = 0.006,  // within one and a half radii of it
  far_size = 0.09
];
tip = Sqrt(3) * radius;
bottom = tip + penetration + below;

Point(1) = {0, -bottom, 0};
Point(2) = {width, -bottom, 0};
Point(3) = {width, above, 0};
Point(4) = {radius, above, 0};
Point(5) = {radius, 0, 0};
Point(6) = {Sqrt(3) / 2 * tip_radius, -tip + 1.5 * tip_radius, 0};
Point(7) = {0, -tip + tip_radius, 0};
Point(8) = {0, -tip + 2 * tip_radius, 0};
Point(9) = {0, above, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Circle(6) = {6, 8, 7};
Line(7) = {7, 1};
Line(8) = {4, 9};
Line(9) = {9, 7};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7};
Curve Loop(2) = {-6, -5, -4, 8, 9};
Plane Surface(1) = {1};
Plane Surface(2) = {2};

Field[1] = Box;
Field[1].VIn = cell_size;
Field[1].VOut = far_size;
Field[1].XMin = 0;
Field[1].XMax = radius + 4 * cell_size;
Field[1].YMin = -tip - penetration - 6 * cell_size;
Field[1].YMax = above;
Field[1].Thickness = 0.5 * radius * (far_size - cell_size) / (near_size - 0.5 * cell_size);
Field[2] = Box;
Field[2].VIn = near_size;
Field[2].VOut = far_size;
Field[2].XMin = 0;
Field[2].XMax = 2.5 * radius;
Field[2].YMin = -tip - penetration - 1.5 * radius;
Field[2].YMax = above;
Field[2].Thickness = width;
Field[3] = Min;
Field[3].FieldsList = {1, 2};
Background Field = 3;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("soil", 1) = {1};
Physical Surface("cone", 2) = {2};
Physical Curve("axis", 1) = {7, 9};
Physical Curve("base", 2) = {1};
Physical Curve("far", 3) = {2};
Physical Curve("top", 4) = {3, 8};
