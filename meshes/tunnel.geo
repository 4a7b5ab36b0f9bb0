// Half of a section around a shallow tunnel, whose axis of symmetry is x = 0: 2D, unstructured, finest at the lining. The surface is at y = 0.
DefineConstant[
  radius = 3,
  cover = 10,         // from the surface to the crown
  below = 12,         // from the invert to the base
  width = 60,
  parts = 24,         // of a quarter of the lining
  cell_size = 0.4     // around the lining; far away it grows to six times that
];

centre = -cover - radius;
base = centre - radius - below;
Point(1) = {0, centre, 0};
Point(2) = {0, centre - radius, 0};
Point(3) = {radius, centre, 0};
Point(4) = {0, centre + radius, 0};
Point(5) = {0, base, 0};
Point(6) = {width, base, 0};
Point(7) = {width, 0, 0};
Point(8) = {0, 0, 0};
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
// The nodes of the lining: equal parts from the invert to the side, and as many from there to the crown
Transfinite Curve{1, 2} = parts + 1;

Field[1] = Ball;
Field[1].YCenter = centre;
Field[1].VIn = cell_size;
Field[1].VOut = 6 * cell_size;
Field[1].Radius = 1.5 * radius;
Field[1].Thickness = width / 2;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("ground") = {2};
Physical Surface("core") = {1};
Physical Curve("axis") = {3, 7, 8};
Physical Curve("wall") = {1, 2};
Physical Curve("base") = {4};
Physical Curve("right") = {5};
Physical Curve("surface") = {6};
