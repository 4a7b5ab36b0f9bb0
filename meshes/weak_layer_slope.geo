// A slope 1:2 on a foundation as thick as the slope is high, crossed by a thin layer of another soil: the third
// example of Griffiths and Lane (1999), Geotechnique 49, 387-403, figure 6. The paper names no coordinates; those
// here, in units of the height, are as the authors of XSLOPE (github.com/njones61/xslope) measured them in the
// figure: 0.6 + 0.2 + 1.2 on the crest, 1.2 + 0.2 + 0.6 before the toe, 0.4 + 0.2 + 0.4 over the depth. The layer
// runs parallel to the slope, level below the toe, and rises at 45 degrees.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  height = 10.0,
  cell_size = 1.0,   // on the slope
  layer_size = 0.5,  // in the layer
  far_size = 2.0
];

Point(1) = {0, -height, 0, far_size};
Point(2) = {6 * height, -height, 0, far_size};
Point(3) = {6 * height, 0, 0, far_size};
Point(4) = {5.4 * height, 0, 0, layer_size};
Point(5) = {5.2 * height, 0, 0, layer_size};
Point(6) = {4 * height, 0, 0, cell_size};
Point(7) = {2 * height, height, 0, cell_size};
Point(8) = {0.8 * height, height, 0, layer_size};
Point(9) = {0.6 * height, height, 0, layer_size};
Point(10) = {0, height, 0, far_size};
Point(11) = {3.6 * height, -0.4 * height, 0, layer_size};
Point(12) = {4.8 * height, -0.4 * height, 0, layer_size};
Point(13) = {3.8 * height, -0.6 * height, 0, layer_size};
Point(14) = {4.8 * height, -0.6 * height, 0, layer_size};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 9};
Line(9) = {9, 10};
Line(10) = {10, 1};
Line(11) = {8, 11};  // upper side of the layer
Line(12) = {11, 12};
Line(13) = {12, 5};
Line(14) = {9, 13};  // lower side
Line(15) = {13, 14};
Line(16) = {14, 4};
Curve Loop(1) = {5, 6, 7, 11, 12, 13};
Plane Surface(1) = {1};
Curve Loop(2) = {-11, 8, 14, 15, 16, 4, -13, -12};
Plane Surface(2) = {2};
Curve Loop(3) = {1, 2, 3, -16, -15, -14, 9, 10};
Plane Surface(3) = {3};

Physical Surface("clay", 1) = {1, 3};
Physical Surface("layer", 2) = {2};
Physical Curve("left", 1) = {10};
Physical Curve("base", 2) = {1};
Physical Curve("right", 3) = {2};
Physical Curve("surface", 5) = {3, 4, 5, 6};
Physical Curve("crest", 6) = {7, 8, 9};
