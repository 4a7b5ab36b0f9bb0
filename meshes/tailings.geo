// A tailings dam raised upstream: a starter dam, the shell of its dikes at 1:4 above it, and the tailings behind both, on firm ground, with free space
// below the toe for a slide: 2D, unstructured. Lengths in m.
SetFactory("OpenCASCADE");
DefineConstant[ height = 18, starter = 6, beach = 60, ground = 6, runout = 80, headroom = 2, cell_size = 2 ];
e = 1e-3;
crest = beach + 8;                         // outer edge of the shell's crest
shoulder = crest + 4 * (height - starter); // where the shell meets the starter dam
toe = shoulder + 6 + 2 * starter;
width = toe + runout;
heel = shoulder - 1.5 * starter;
Rectangle(1) = {0, -ground, 0, width, ground};
Rectangle(2) = {0, 0, 0, width, height + headroom};
Point(101) = {heel, 0, 0};             Point(102) = {toe, 0, 0};
Point(103) = {shoulder + 6, starter, 0}; Point(104) = {shoulder, starter, 0};
Point(105) = {crest, height, 0};       Point(106) = {beach, height, 0};
Point(107) = {shoulder - 8, starter, 0};
Point(108) = {0, 0, 0};                Point(109) = {0, height, 0};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Line(105) = {104, 105}; Line(106) = {105, 106}; Line(107) = {106, 107}; Line(108) = {107, 104};
Line(109) = {108, 101}; Line(110) = {106, 109}; Line(111) = {109, 108};
Curve Loop(101) = {101, 102, 103, 104};            Plane Surface(101) = {101};
Curve Loop(102) = {105, 106, 107, 108};            Plane Surface(102) = {102};
Curve Loop(103) = {109, -104, -108, -107, 110, 111}; Plane Surface(103) = {103};
BooleanFragments{ Surface{1, 2, 101, 102, 103}; Delete; }{}
Physical Surface("starter dam") = {101};
Physical Surface("shell") = {102};
Physical Surface("tailings") = {103};
below[] = Surface In BoundingBox{-e, -ground - e, -e, width + e, e, e};
Physical Surface("ground") = {below[]};
air[] = Surface{:};
air[] -= {101, 102, 103, below[]};
Physical Surface("air") = {air[]};
Physical Curve("base") = {Curve In BoundingBox{-e, -ground - e, -e, width + e, -ground + e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -ground - e, -e, e, height + headroom + e, e}};
Physical Curve("right") = {Curve In BoundingBox{width - e, -ground - e, -e, width + e, height + headroom + e, e}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
