// A bank that meets a steep abutment at y = width, the ground below and before it, and the air over them: 3D, tetrahedra. The plane y = 0 is one of
// symmetry; z points up. Lengths in m.
SetFactory("OpenCASCADE");
DefineConstant[ height = 8, slope = 1.5, crest = 8, depth = 3, beside = 16, width = 16, headroom = 1, cell_size = 2 ];
e = 1e-3;
toe = crest + slope * height;
length = toe + beside;
Point(1) = {0, 0, -depth};    Point(2) = {length, 0, -depth}; Point(3) = {length, 0, 0};
Point(4) = {toe, 0, 0};       Point(5) = {crest, 0, height};  Point(6) = {0, 0, height};
Point(7) = {0, 0, 0};         Point(8) = {length, 0, height + headroom}; Point(9) = {0, 0, height + headroom};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 7}; Line(5) = {7, 1};
Line(6) = {4, 5}; Line(7) = {5, 6}; Line(8) = {6, 7};
Line(9) = {3, 8}; Line(10) = {8, 9}; Line(11) = {9, 6};
Curve Loop(1) = {1, 2, 3, 4, 5};          Plane Surface(1) = {1};
Curve Loop(2) = {6, 7, 8, -4};            Plane Surface(2) = {2};
Curve Loop(3) = {-3, 9, 10, 11, -7, -6};  Plane Surface(3) = {3};
ground[] = Extrude {0, width, 0} { Surface{1}; };
bank[] = Extrude {0, width, 0} { Surface{2}; };
air[] = Extrude {0, width, 0} { Surface{3}; };
BooleanFragments{ Volume{ground[1], bank[1], air[1]}; Delete; }{}
Physical Volume("ground") = {ground[1]};
Physical Volume("bank") = {bank[1]};
Physical Volume("air") = {air[1]};
top = height + headroom + e;
Physical Surface("base") = {Surface In BoundingBox{-e, -e, -depth - e, length + e, width + e, -depth + e}};
Physical Surface("left") = {Surface In BoundingBox{-e, -e, -depth - e, e, width + e, top}};
Physical Surface("right") = {Surface In BoundingBox{length - e, -e, -depth - e, length + e, width + e, top}};
Physical Surface("front") = {Surface In BoundingBox{-e, -e, -depth - e, length + e, e, top}};
Physical Surface("abutment") = {Surface In BoundingBox{-e, width - e, -depth - e, length + e, width + e, top}};
Mesh.MeshSizeMin = cell_size;
Mesh.MeshSizeMax = cell_size;
