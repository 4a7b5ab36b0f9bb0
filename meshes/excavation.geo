// Half of a pit with slopes, dug in three steps: 2D, unstructured. The axis of symmetry is at x = 0.
SetFactory("OpenCASCADE");
DefineConstant[ depth = 4.5, slope = 1.5, half_width = 4, below = 5.5, width = 30, cell_size = 0.75 ];
top = below + depth;
e = 1e-3;
Rectangle(1) = {0, 0, 0, width, top};
For k In {1 : 3}
  low = top - k * depth / 3;
  Point(200 + 4 * k) = {0, low, 0}; Point(201 + 4 * k) = {half_width + slope * (low - below), low, 0};
  Point(202 + 4 * k) = {half_width + slope * (low + depth / 3 - below), low + depth / 3, 0}; Point(203 + 4 * k) = {0, low + depth / 3, 0};
  For j In {0 : 3}
    Line(200 + 4 * k + j) = {200 + 4 * k + j, 200 + 4 * k + (j + 1) % 4};
  EndFor
  Curve Loop(200 + k) = {200 + 4 * k, 201 + 4 * k, 202 + 4 * k, 203 + 4 * k};
  Plane Surface(200 + k) = {200 + k};
EndFor
BooleanFragments{ Surface{1, 201, 202, 203}; Delete; }{}
ground[] = Surface{:};
For k In {1 : 3}
  pit[] = Surface In BoundingBox{-e, top - k * depth / 3 - e, -e, width - e, top - (k - 1) * depth / 3 + e, e};
  Physical Surface(Sprintf("cut %g", k)) = {pit[]};
  ground[] -= pit[];
EndFor
Physical Surface("ground") = {ground[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, width + e, e, e}};
Physical Curve("axis") = {Curve In BoundingBox{-e, -e, -e, e, top + e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -e, -e, width + e, top + e, e}};
Mesh.MeshSizeMax = cell_size;
