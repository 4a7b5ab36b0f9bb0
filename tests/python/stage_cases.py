"""Sites that tests of stages share."""

from __future__ import annotations

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

ROLLERS = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]


def geometry(rectangles, soils, width, inner, cell_size):
    """A .geo file of a site 6 m high: rectangles [m] with their soils, its sides by name, and one boundary inside by name.

    inner: name, x and y of its ends [m]
    """
    sides = {"base": (0, 0, width, 0), "left": (0, 0, 0, 6), "right": (width, 0, width, 6), inner[0]: inner[1:]}
    return "\n".join([
        'SetFactory("OpenCASCADE");', f"DefineConstant[ cell_size = {cell_size} ];", "e = 0.01;",
        *(f"Rectangle({k}) = {{{x}, {y}, 0, {w}, {h}}};" for k, (x, y, w, h) in enumerate(rectangles, 1)),
        "Coherence;",
        *(f'Physical Surface("{soil}") = {{{number}}};' for soil, number in soils.items()),
        *(f'Physical Curve("{name}") = {{Curve In BoundingBox{{{x} - e, {y} - e, -e, {u} + e, {v} + e, e}}}};'
          for name, (x, y, u, v) in sides.items()),
        "Mesh.MeshSizeMax = cell_size;\n",
    ])  # fmt: skip


GEOMETRIES = {
    "pit": geometry([(0, 0, 9, 6), (0, 4, 3, 2), (0, 3, 3, 1)], {"pit 1": 2, "pit 2": 3, "ground": 4}, 9,
                    ("floor", 0, 3, 3, 3), 1.0),
    "column": geometry([(0, 0, 1, 3), (0, 3, 1, 1), (0, 4, 1, 2)], {"ground": 1, "layer 1": 2, "layer 2": 3}, 1,
                       ("surface", 0, 3, 1, 3), 0.5),
}  # fmt: skip
SOILS = {"pit": ("ground", "pit 1", "pit 2"), "column": ("ground", "layer 1", "layer 2")}
YOUNG = {"ground": 20e6, "pit 1": 10e6, "pit 2": 5e6, "layer 1": 10e6, "layer 2": 5e6}
WEIGHT = {"ground": 20e3, "pit 1": 18e3, "pit 2": 19e3, "layer 1": 18e3, "layer 2": 16e3}
POISSON = 0.3


def mesh_of(name, folder, comm=MPI.COMM_WORLD):
    """(domain, cell_tags, facet_tags) of the pit or the column."""
    path = folder / f"{name}.geo"
    if comm.rank == 0:
        path.write_text(GEOMETRIES[name])
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


IN_SITU = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]))
DIG = [bridge.Stage("dig 1", excavate="pit 1"), bridge.Stage("dig 2", excavate="pit 2", pressure={"floor": 5e3})]


def carried_out(site, *stages):
    """Reports of the stages."""
    return list(bridge.carry_out(site, stages))
