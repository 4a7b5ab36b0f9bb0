"""Sites that tests of stages share."""

from __future__ import annotations

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

ROLLERS = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
PIT = """
SetFactory("OpenCASCADE");
DefineConstant[ cell_size = 1.0 ];
Rectangle(1) = {0, 0, 0, 9, 6}; Rectangle(2) = {0, 4, 0, 3, 2}; Rectangle(3) = {0, 3, 0, 3, 1};
Coherence;
Physical Surface("pit 1") = {2}; Physical Surface("pit 2") = {3}; Physical Surface("ground") = {4};
e = 0.01;
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, 9 + e, e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -e, -e, e, 6 + e, e}};
Physical Curve("right") = {Curve In BoundingBox{9 - e, -e, -e, 9 + e, 6 + e, e}};
Physical Curve("floor") = {Curve In BoundingBox{-e, 3 - e, -e, 3 + e, 3 + e, e}};
Mesh.MeshSizeMax = cell_size;
"""
COLUMN = """
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 1, 3}; Rectangle(2) = {0, 3, 0, 1, 1}; Rectangle(3) = {0, 4, 0, 1, 2};
Coherence;
Physical Surface("ground") = {1}; Physical Surface("layer 1") = {2}; Physical Surface("layer 2") = {3};
e = 0.01;
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, 1 + e, e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -e, -e, e, 6 + e, e}};
Physical Curve("right") = {Curve In BoundingBox{1 - e, -e, -e, 1 + e, 6 + e, e}};
Physical Curve("surface") = {Curve In BoundingBox{-e, 3 - e, -e, 1 + e, 3 + e, e}};
Mesh.MeshSizeMax = 0.5;
"""
SOILS = {"pit": ("ground", "pit 1", "pit 2"), "column": ("ground", "layer 1", "layer 2")}
YOUNG = {"ground": 20e6, "pit 1": 10e6, "pit 2": 5e6, "layer 1": 10e6, "layer 2": 5e6}
WEIGHT = {"ground": 20e3, "pit 1": 18e3, "pit 2": 19e3, "layer 1": 18e3, "layer 2": 16e3}
POISSON = 0.3


def mesh_of(name, folder, comm=MPI.COMM_WORLD):
    """(domain, cell_tags, facet_tags) of the pit or the column."""
    path = folder / f"{name}.geo"
    if comm.rank == 0:
        path.write_text({"pit": PIT, "column": COLUMN}[name])
    comm.barrier()
    return bridge.read_mesh(path, comm)


def weights(soils):
    return {soil: WEIGHT[soil] for soil in soils}


def elastic(soils):
    return {soil: mpm.LinearElastic(young=YOUNG[soil], poisson=POISSON) for soil in soils}


def site_of(mesh, laws, supports=ROLLERS, first_step=0.25, **options):
    """FemSite with nothing there yet."""
    domain, cell_tags, facet_tags = mesh
    fem = bridge.QuasiStatic(domain, laws, facet_tags, supports, cell_tags=cell_tags, **options)
    return bridge.FemSite(fem, first_step)


def at_once(mesh, soils, laws, load, supports=ROLLERS, **options):
    """QuasiStatic of some soils alone, loaded at once."""
    body, cell_tags, facet_tags = bridge.soil_mesh(*mesh, tag=soils)
    fem = bridge.QuasiStatic(body, {s: laws[s] for s in soils}, facet_tags, supports, cell_tags=cell_tags, **options)
    fem.solve(load)
    return fem


def oedometer(soil):
    return YOUNG[soil] * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
