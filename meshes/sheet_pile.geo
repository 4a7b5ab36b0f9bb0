// Ground with a sheet pile at x = 0, y = 0 at its surface: 2D, unstructured, finer at the tip of the pile.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[ thickness = 4.0, depth = 2.0, pile = 0.02, beside = 12.0, tip_size = 0.02, cell_size = 0.5 ];
near = Min(cell_size, 5 * tip_size + depth / 10);

Point(1) = {-beside, -thickness, 0, cell_size};
Point(2) = {beside, -thickness, 0, cell_size};
Point(3) = {beside, 0, 0, cell_size};
Point(4) = {pile / 2, 0, 0, near};
Point(5) = {pile / 2, -depth, 0, tip_size};
Point(6) = {-pile / 2, -depth, 0, tip_size};
Point(7) = {-pile / 2, 0, 0, near};
Point(8) = {-beside, 0, 0, cell_size};
For k In {1:8}
  Line(k) = {k, k % 8 + 1};
EndFor
Curve Loop(1) = {1:8};
Plane Surface(1) = {1};

Physical Surface("sand", 1) = {1};
Physical Curve("base", 1) = {1};
Physical Curve("downstream", 2) = {3};
Physical Curve("pile", 3) = {4:6};
Physical Curve("upstream", 4) = {7};
