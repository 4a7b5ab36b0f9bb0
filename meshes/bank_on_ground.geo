// A bank on the ground before and below it, and the air or water over them: 2D, unstructured. The toe is at y = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  height = 8, slope = 2, crest = 10, depth = 4, beside = 10, headroom = 1, cell_size = 0.8
];
toe = crest + slope * height;
width = toe + beside;
e = 1e-3;
Rectangle(1) = {0, -depth, 0, width, depth};
Rectangle(2) = {0, 0, 0, width, height + headroom};
Point(101) = {0, 0, 0}; Point(102) = {toe, 0, 0}; Point(103) = {crest, height, 0}; Point(104) = {0, height, 0};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(3) = {101};
BooleanFragments{ Surface{1, 2, 3}; Delete; }{}
ground[] = Surface In BoundingBox{-e, -depth - e, -e, width + e, e, e};
bank[] = Surface In BoundingBox{-e, -e, -e, toe + e, height + e, e};
air[] = Surface{:};
air[] -= ground[];
air[] -= bank[];
Physical Surface("ground") = {ground[]};
Physical Surface("bank") = {bank[]};
Physical Surface("air") = {air[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -depth - e, -e, width + e, -depth + e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -depth - e, -e, e, height + headroom + e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -depth - e, -e, width + e, height + headroom + e, e}};
face[] = Curve In BoundingBox{crest - e, -e, -e, toe + e, height + e, e};
face[] += Curve In BoundingBox{toe - e, -e, -e, width + e, e, e};
Physical Curve("face") = {face[]};
Physical Curve("crest") = {Curve In BoundingBox{-e, height - e, -e, crest + e, height + e, e}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
