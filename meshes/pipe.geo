// Half of a section around a pipe deep in the ground: the axis of symmetry is x = 0, the pipe's centre the origin.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  radius = 0.5,
  size = 4,             // half of the height and the width of the ground
  edge_size = 0.025,    // of the cells in the pipe and within a fifth of its radius
  far_size = 0.6
];

Point(1) = {0, 0, 0};
Point(2) = {0, -radius, 0};
Point(3) = {radius, 0, 0};
Point(4) = {0, radius, 0};
Point(5) = {0, -size, 0};
Point(6) = {size, -size, 0};
Point(7) = {size, size, 0};
Point(8) = {0, size, 0};
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};
Line(3) = {4, 2};
Line(4) = {5, 6};
Line(5) = {6, 7};
Line(6) = {7, 8};
Line(7) = {8, 4};
Line(8) = {2, 5};
Curve Loop(1) = {1, 2, 3};
Curve Loop(2) = {4, 5, 6, 7, -2, -1, 8};
Plane Surface(1) = {1};
Plane Surface(2) = {2};

Field[1] = Ball;
Field[1].VIn = edge_size;
Field[1].VOut = far_size;
Field[1].Radius = 1.2 * radius;
Field[1].Thickness = size;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("soil", 1) = {2};
Physical Surface("pipe", 2) = {1};
Physical Curve("axis", 1) = {3, 7, 8};
Physical Curve("far", 2) = {4, 5, 6};
