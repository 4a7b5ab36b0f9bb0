"""Load on deep elastic ground: the ground beyond the particles is replaced by a stiffness at their border.

A strip load with a half-width of 1 m, or a circular load with this radius, acts on ground 20 m wide and 10 m deep. A
computation with particles in all of the ground is compared with one that has particles only in the 5 m by 4 m under the load,
on the same mesh, and linear or quadratic elements beyond, whose nodes at the border match those of the particles' mesh or do
not. Large linear elements are stiffer than the cells that they replace, and quadratic ones are softer.
"""

import matplotlib.pyplot as plt
import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.figures import save_figure
from common.files import ROOT
from common.plots import paper_style
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
YOUNG, POISSON, DENSITY, PRESSURE = 10e6, 0.3, 2000.0, 1e3  # Pa, -, kg/m3, Pa
SIDES = [bridge.roller("axis", (1, 0)), bridge.roller("side", (1, 0)), bridge.fixed("base")]


def ground(size, far_size, soil):
    """The mesh of the soils of these names, with cells of `size` m near the load and `far_size` m far away."""
    parameters = {"near_size": size, "far_size": far_size}
    return bridge.soil_mesh(*bridge.read_mesh(ROOT / "meshes" / "deep_ground.geo", COMM, parameters=parameters), soil)


def particles(parts, geometry):
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = mpm.Model(bridge.background_mesh(*parts), law, geometry=geometry)
    model.seed(density=DENSITY, per_cell=3)
    model.roller("axis", (1, 0))
    return model


def step(model):
    """Places at the surface up to the border [m], and their displacements (n, 2) [m]."""
    model.traction("footing", (0.0, -PRESSURE))
    model.implicit(1.0, dt=1.0, quasi_static=True).last()
    rows = np.flatnonzero((model.mesh.points[:, 1] > -1e-9) & (model.mesh.points[:, 0] < 5.0 + 1e-9))
    every = COMM.allgather((model.mesh.points[rows, 0], model.nodal("velocity")[rows]))
    places, moved = (np.concatenate(part) for part in zip(*every, strict=True))
    places, first = np.unique(np.round(places, 9), return_index=True)
    return places, moved[first]


def save_meshes(path, model, far, scale):
    """Draw particles' mesh and elements, moved, by their settlement."""
    moved = far.displacement(model)
    domain = moved.function_space.mesh
    arrays = bridge.background_arrays(domain)
    values = bridge.evaluate_at(arrays["points"], displacement=moved)["displacement"]
    meshes = (
        (model.mesh.points, model.mesh.cells, model.nodal("velocity")),
        (arrays["points"], arrays["cells"], values),
    )
    most = max(-values[:, 1].min() for *_, values in meshes)
    with paper_style():
        figure, axes = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
        for (points, cells, values), width in zip(meshes, (0.2, 0.6), strict=True):
            x, y = (points + scale * values).T
            shades = axes.tripcolor(x, y, -1e3 * values[:, 1], triangles=cells, shading="gouraud", vmin=0, vmax=1e3 * most,
                                    cmap="viridis", rasterized=True)  # fmt: skip
            axes.triplot(x, y, cells, color="white", linewidth=width)
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"Displacements magnified {scale:g} times")
        figure.colorbar(shades, ax=axes, label="Settlement [mm]")
        save_figure(figure, path)


def particles_everywhere(size, geometry):
    """What `step` returns without a far field."""
    whole = particles(ground(size, size, ["near", "far"]), geometry)
    whole.roller("side", (1, 0))
    whole.fix("base")
    return step(whole)


def beyond(parts, geometry, degree):
    """The far field of these elements, with the geometry of the particles."""
    body, _, facets = parts
    return bridge.FarField(
        body, facets, border="border", supports=SIDES, young=YOUNG, poisson=POISSON, degree=degree, geometry=geometry
    )


def difference(kind, moved, expected, tolerance):
    error = np.abs(moved - expected).max() / np.abs(expected).max()
    name = f"displacement of the surface, {kind}: largest difference"
    return Check(
        name, 0.0, "particles in all of the ground", error, tolerance, scale=1.0, over="the largest displacement"
    )


def run(quick: bool, folder) -> Result:
    # --- 1. Particles everywhere -------------------------------------------------------------------------------------
    size = 0.5 if quick else 0.25
    strip, circle = mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC
    places, expected = particles_everywhere(size, strip)
    curves, checks = {}, []

    # --- 2. Particles near the load, elements of some kinds beyond ---------------------------------------------------
    near = ground(size, size, "near")
    for degree, far_size, tolerance in ((1, size, 1e-8), (1, 2.0, 0.02), (2, 2.0, 5e-3)):
        model = particles(near, strip)
        far = beyond(ground(size if far_size == size else 2 * size, far_size, "far"), strip, degree)
        far.attach(model, "border")
        there, moved = step(model)
        kind = ("linear elements, " if degree == 1 else "quadratic elements, ") + (
            "the same nodes" if far_size == size else f"to {far_size:g} m"
        )
        checks.append(difference(kind, moved, expected, tolerance))
        curves[kind] = (there, -1e3 * moved[:, 1])

    # --- 3. The circular load ----------------------------------------------------------------------------------------
    footing = particles(near, circle)
    beyond(ground(2 * size, 2.0, "far"), circle, 2).attach(footing, "border")
    checks.append(
        difference(
            "circular load, quadratic elements, to 2 m", step(footing)[1], particles_everywhere(size, circle)[1], 5e-3
        )
    )

    # --- 4. Pictures -------------------------------------------------------------------------------------------------
    if COMM.rank == 0:
        save_comparison(folder / "surface.png", curves, {"particles everywhere": (places, -1e3 * expected[:, 1])},
                        ("Distance from the axis [m]", "Settlement of the surface [mm]"))  # fmt: skip
    figures = {
        "surface.png": "Settlement of the surface under a strip load, with particles only in the 5 m by 4 m under it"
    }
    if COMM.size == 1:
        save_meshes(folder / "meshes.png", model, far, 2000.0)
        figures[
            "meshes.png"
        ] = "Cells of particles under the load, and quadratic elements beyond, whose nodes do not match"
    return Result(checks, figures)
