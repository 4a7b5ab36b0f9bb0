// An earth dam with a core on a pervious foundation: 2D, unstructured. The heel is at x = 0, the ground at y = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  height = 12, crest = 4, slope = 2, core_top = 2, core_base = 6, depth = 4, beside = 8, cell_size = 0.6
];
width = 2 * slope * height + crest;
middle = width / 2;
e = 1e-3;
Rectangle(1) = {-beside, -depth, 0, width + 2 * beside, depth};
Point(101) = {0, 0, 0}; Point(102) = {width, 0, 0};
Point(103) = {slope * height + crest, height, 0}; Point(104) = {slope * height, height, 0};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(2) = {101};
Point(111) = {middle - core_base / 2, 0, 0}; Point(112) = {middle + core_base / 2, 0, 0};
Point(113) = {middle + core_top / 2, height, 0}; Point(114) = {middle - core_top / 2, height, 0};
Line(111) = {111, 112}; Line(112) = {112, 113}; Line(113) = {113, 114}; Line(114) = {114, 111};
Curve Loop(111) = {111, 112, 113, 114}; Plane Surface(3) = {111};
BooleanFragments{ Surface{1, 2, 3}; Delete; }{}
foundation[] = Surface In BoundingBox{-beside - e, -depth - e, -e, width + beside + e, e, e};
core[] = Surface In BoundingBox{middle - core_base / 2 - e, -e, -e, middle + core_base / 2 + e, height + e, e};
shell[] = Surface{:};
shell[] -= foundation[];
shell[] -= core[];
Physical Surface("foundation") = {foundation[]};
Physical Surface("core") = {core[]};
Physical Surface("shell") = {shell[]};
upstream[] = Curve In BoundingBox{-beside - e, -e, -e, e, e, e};
upstream[] += Curve In BoundingBox{-e, -e, -e, slope * height + e, height + e, e};
downstream[] = Curve In BoundingBox{width - e, -e, -e, width + beside + e, e, e};
downstream[] += Curve In BoundingBox{slope * height + crest - e, -e, -e, width + e, height + e, e};
inner[] = Curve In BoundingBox{e, -e, -e, width - e, e, e};
upstream[] -= inner[];
downstream[] -= inner[];
Physical Curve("upstream") = {upstream[]};
Physical Curve("downstream") = {downstream[]};
Physical Curve("crest") = {Curve In BoundingBox{slope * height - e, height - e, -e, slope * height + crest + e, height + e, e}};
Physical Curve("base") = {Curve In BoundingBox{-beside - e, -depth - e, -e, width + beside + e, -depth + e, e}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
