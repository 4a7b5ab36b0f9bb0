// A levee on a layer of sand over stiffer ground, and the air over them: 2D, unstructured. The ground surface is at y = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  height = 4, slope = 2, crest = 4, sand = 6, stiff = 4, beside = 24, headroom = 1, cell_size = 0.5
];
width = 2 * beside + 2 * slope * height + crest;
top = height + headroom;
e = 1e-3;
Rectangle(1) = {0, -sand - stiff, 0, width, stiff};
Rectangle(2) = {0, -sand, 0, width, sand};
Rectangle(3) = {0, 0, 0, width, top};
toe = beside + 2 * slope * height + crest;
Point(101) = {beside, 0, 0}; Point(102) = {toe, 0, 0};
Point(103) = {toe - slope * height, height, 0}; Point(104) = {beside + slope * height, height, 0};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(4) = {101};
BooleanFragments{ Surface{1, 2, 3, 4}; Delete; }{}
stiffer[] = Surface In BoundingBox{-e, -sand - stiff - e, -e, width + e, -sand + e, e};
sands[] = Surface In BoundingBox{-e, -sand - e, -e, width + e, e, e};
levee[] = Surface In BoundingBox{beside - e, -e, -e, toe + e, height + e, e};
air[] = Surface{:};
air[] -= stiffer[];
air[] -= sands[];
air[] -= levee[];
Physical Surface("stiff") = {stiffer[]};
Physical Surface("sand") = {sands[]};
Physical Surface("levee") = {levee[]};
Physical Surface("air") = {air[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -sand - stiff - e, -e, width + e, -sand - stiff + e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -sand - stiff - e, -e, e, e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -sand - stiff - e, -e, width + e, e, e}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
