"""Bodies whose motion dies away without end are at rest, not in a mechanism: soil without cohesion beside a rigid raft."""

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

STRIP = """
SetFactory("OpenCASCADE");
DefineConstant[ cell_size = 0.8 ];
e = 1e-3;
Rectangle(1) = {0, 0, 0, 8, 4};
Point(100) = {1, 4, 0}; Point(101) = {0, 4, 0}; Line(100) = {101, 100};
BooleanFragments{ Surface{1}; Delete; }{ Curve{100}; Delete; }
Physical Surface("sand") = {Surface{:}};
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, 8 + e, e, e}};
Physical Curve("axis") = {Curve In BoundingBox{-e, -e, -e, e, 4 + e, e}};
Physical Curve("right") = {Curve In BoundingBox{8 - e, -e, -e, 8 + e, 4 + e, e}};
Physical Curve("raft") = {Curve In BoundingBox{-e, 4 - e, -e, 1 + e, 4 + e, e}};
Field[1] = Distance; Field[1].PointsList = {100};
Field[2] = Threshold; Field[2].InField = 1; Field[2].SizeMin = cell_size / 8; Field[2].SizeMax = cell_size; Field[2].DistMin = 0.05; Field[2].DistMax = 3;
Background Field = 2; Mesh.MeshSizeExtendFromBoundary = 0;
"""


def test_a_factor_of_safety_does_not_end_at_soil_beside_a_raft_that_comes_to_rest_slowly(tmp_path):
    """A strength divided by 1.1 carries the load, which is shown by itself, and so the factor is more than that, from any start."""
    path = tmp_path / "strip.geo"
    path.write_text(STRIP)
    domain, cell_tags, facet_tags = bridge.read_mesh(path, MPI.COMM_WORLD)
    sand = mpm.MohrCoulomb(young=30e6, poisson=0.3, cohesion=100.0, friction_angle=30.0, dilation_angle=30.0)
    raft = mpm.beam([(0.0, 4.0), (1.0, 4.0)], axial_stiffness=30e9, bending_stiffness=5e9, clamped_start=True)
    supports = [bridge.fixed("base"), bridge.roller("axis", (1, 0)), bridge.roller("right", (1, 0))]
    load = bridge.Load(unit_weight=18e3, pressure={"raft": 268e3})

    def fresh(law):
        fem = bridge.QuasiStatic(domain, {"sand": law}, facet_tags, supports, cell_tags=cell_tags)
        fem.reconfigure(members={"raft": raft})
        return fem

    weak = fresh(bridge.reduced_strength(sand, 1.1))
    weak.solve(load)
    assert weak.converged
    found = bridge.factor_of_safety(fresh(sand), load, start=0.5)
    assert found.failed and 1.1 < found.value < 1.15
