// Half of a pit with vertical walls, dug in two steps below the groundwater table between walls that reach below its bottom: 2D,
// unstructured. The axis of symmetry is at x = 0; the mesh follows the wall, and is finest there.
SetFactory("OpenCASCADE");
DefineConstant[ half_width = 6, depth = 6, wall = 13, width = 45, height = 24, cell_size = 1 ];
e = 1e-3;
below[] = {0, depth / 2, depth};
Rectangle(1) = {0, 0, 0, width, height};
For k In {1 : 2}
  Rectangle(1 + k) = {0, height - below[k], 0, half_width, below[k] - below[k - 1]};
EndFor
Point(100) = {half_width, height, 0};
Point(101) = {half_width, height - wall, 0};
Line(100) = {100, 101};
BooleanFragments{ Surface{1 : 3}; Delete; }{ Curve{100}; Delete; }
ground[] = Surface{:};
For k In {1 : 2}
  cut[] = Surface In BoundingBox{-e, height - below[k] - e, -e, half_width + e, height - below[k - 1] + e, e};
  Physical Surface(Sprintf("cut %g", k)) = {cut[]};
  ground[] -= cut[];
  Physical Curve(Sprintf("floor %g", k)) = {Curve In BoundingBox{-e, height - below[k] - e, -e, half_width + e, height - below[k] + e, e}};
EndFor
Physical Surface("ground") = {ground[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, width + e, e, e}};
Physical Curve("axis") = {Curve In BoundingBox{-e, -e, -e, e, height + e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -e, -e, width + e, height + e, e}};
Field[1] = Box;
Field[1].XMin = half_width - 2;
Field[1].XMax = half_width + 2;
Field[1].YMin = height - wall - 3;
Field[1].YMax = height;
Field[1].VIn = cell_size / 2;
Field[1].VOut = 2 * cell_size;
Field[1].Thickness = 15;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
