// Half of an embankment in layers on soft clay, and the air around it: 2D, unstructured. The axis of symmetry is at x = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  height = 4, slope = 1.5, crest = 5, depth = 3, width = 26, headroom = 1, cell_size = 0.5
];
toe = crest + slope * height;
e = 1e-3;
Rectangle(1) = {0, 0, 0, width, depth};
Rectangle(2) = {0, depth, 0, width, height + headroom};
// The embankment as a polygon, cut by the tops of its four layers
Point(101) = {0, depth, 0}; Point(102) = {toe, depth, 0}; Point(103) = {crest, depth + height, 0}; Point(104) = {0, depth + height, 0};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(3) = {101};
For k In {1 : 3}
  Point(110 + 2 * k) = {0, depth + k * height / 4, 0};
  Point(111 + 2 * k) = {toe - k * slope * height / 4, depth + k * height / 4, 0};
  Line(110 + k) = {110 + 2 * k, 111 + 2 * k};
EndFor
BooleanFragments{ Surface{1, 2, 3}; Delete; }{ Curve{111, 112, 113}; Delete; }
Physical Surface("clay") = {Surface In BoundingBox{-e, -e, -e, width + e, depth + e, e}};
For k In {1 : 4}
  Physical Surface(Sprintf("layer %g", k)) =
    {Surface In BoundingBox{-e, depth + (k - 1) * height / 4 - e, -e, toe + e, depth + k * height / 4 + e, e}};
EndFor
all[] = Surface{:};
soil[] = Surface In BoundingBox{-e, -e, -e, width + e, depth + e, e};
soil[] += Surface In BoundingBox{-e, depth - e, -e, toe + e, depth + height + e, e};
all[] -= soil[];
Physical Surface("air") = {all[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, width + e, e, e}};
Physical Curve("axis") = {Curve In BoundingBox{-e, -e, -e, e, depth + height + headroom + e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -e, -e, width + e, depth + height + headroom + e, e}};
Physical Curve("ground") = {Curve In BoundingBox{-e, depth - e, -e, width + e, depth + e, e}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
