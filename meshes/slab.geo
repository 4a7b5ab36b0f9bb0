// A quarter of a slab of soil under a stiff plate, with a film between them: 2D, diagonals all one way. The middle is (0, 0).
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[ width = 1.0, height = 0.5, film = 0.01, plate = 0.2, cell_size = 0.05 ];

Point(1) = {0, 0, 0};
Point(2) = {width, 0, 0};
Point(3) = {0, height, 0};
Point(4) = {width, height, 0};
Point(5) = {0, height + film, 0};
Point(6) = {width, height + film, 0};
Point(7) = {0, height + film + plate, 0};
Point(8) = {width, height + film + plate, 0};
For k In {0:3}
  Line(1 + k) = {1 + 2 * k, 2 + 2 * k};
EndFor
For k In {0:2}
  Line(11 + k) = {1 + 2 * k, 3 + 2 * k};
  Line(21 + k) = {2 + 2 * k, 4 + 2 * k};
  Curve Loop(1 + k) = {1 + k, 21 + k, -(2 + k), -(11 + k)};
  Plane Surface(1 + k) = {1 + k};
EndFor
Transfinite Curve {1:4} = Round(width / cell_size) + 1;
Transfinite Curve {11, 21} = Round(height / cell_size) + 1;
Transfinite Curve {12, 22} = 2;
Transfinite Curve {13, 23} = Round(plate / cell_size) + 1;
Transfinite Surface {1:3};

Physical Surface("clay", 1) = {1};
Physical Surface("film", 2) = {2};
Physical Surface("plate", 3) = {3};
Physical Curve("base", 1) = {1};
Physical Curve("side", 2) = {21};
Physical Curve("side of the plate", 5) = {22, 23};
Physical Curve("top", 3) = {4};
Physical Curve("axis", 4) = {11:13};
