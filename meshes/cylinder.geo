// A quarter of a thick-walled cylinder about the origin, in plane strain: triangles in rings of equal angle.
// Constants are set with -setnumber, or as `parameters` of fenics_bridge.read_mesh. Lengths in m.
DefineConstant[
  inner = 1.0, outer = 2.0,  // radii
  rings = 8,                 // cells along the radius
  arcs = 12                  // cells along a quarter turn
];

Point(1) = {0, 0, 0};
For k In {0:arcs}
  angle = Pi / 2 * k / arcs;
  Point(100 + k) = {inner * Cos(angle), inner * Sin(angle), 0};
  Point(1000 + k) = {outer * Cos(angle), outer * Sin(angle), 0};
  Line(3000 + k) = {100 + k, 1000 + k};
  Transfinite Curve {3000 + k} = rings + 1;
EndFor
For k In {0:arcs - 1}
  Line(100 + k) = {100 + k, 101 + k};
  Line(1000 + k) = {1000 + k, 1001 + k};
  Transfinite Curve {100 + k, 1000 + k} = 2;
  Curve Loop(k + 1) = {100 + k, 3001 + k, -(1000 + k), -(3000 + k)};
  Plane Surface(k + 1) = {k + 1};
  Transfinite Surface {k + 1} Alternate;
  // Each chord of the wall inside has a tag of its own: a pressure on it has one direction.
  Physical Curve(100 + k) = {100 + k};
EndFor

Physical Surface("soil", 1) = {1:arcs};
Physical Curve("bottom", 1) = {3000};
Physical Curve("left", 2) = {3000 + arcs};
Physical Curve("outer", 3) = {1000:1000 + arcs - 1};
