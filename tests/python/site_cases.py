"""A site of two soils in a file of TOML, which tests of studies share."""

from __future__ import annotations

BLOCK = """
SetFactory("OpenCASCADE");
DefineConstant[ cell_size = 0.5 ];
Rectangle(1) = {0, 0, 0, 1, 1}; Rectangle(2) = {0, 1, 0, 1, 1};
Coherence;
Physical Surface("lower") = {1}; Physical Surface("upper") = {2};
e = 0.01;
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, 1 + e, e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -e, -e, e, 2 + e, e}};
Mesh.MeshSizeMax = cell_size;
"""
WITH_AIR = """
Rectangle(3) = {1, 0, 0, 2, 2};
Coherence;
Physical Surface("air") = {3};
"""
SITE = """
mesh = "block.geo"
cell_size = 0.5
[soils.lower]
unit_weight = 10e3
material = "tresca"
young = 5e6
poisson = 0.45
shear_strength = {value = 20e3, per_metre = 10e3, top = 2.0}
[soils.upper]
unit_weight = 18e3
cohesion = 9e3
friction_angle = 0.0
young = 5e6
"""


def site_in(folder, text=SITE):
    """The file of the site, with its mesh beside it."""
    (folder / "block.geo").write_text(BLOCK)
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


def give_room(folder):
    """Let the mesh of the site in this folder have empty cells, 2 m wide, into which its soil may move."""
    (folder / "block.geo").write_text(
        BLOCK.replace("Coherence;", WITH_AIR).replace("-e, 1 + e, e, e}", "-e, 3 + e, e, e}")
    )
