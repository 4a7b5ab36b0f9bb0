"""A half section against a quarter of the same body in three dimensions: an elastic cylinder, and a collapsing one.

Each body is computed twice, by two parts of the code that have only the laws in common: as a half section of one radian,
and by tetrahedra between two planes of symmetry. The first body is an elastic cylinder, as high as its radius, on rough
ground under its weight, by particles in a quasi-static step. The second is the same cylinder of sand with a little
cohesion, which is released and computed by the explicit scheme until it has spread, with the PIC fraction for soil with
hardly any cohesion. The difference must be no larger than the discretisation error, and decrease with the cell size.
Tetrahedra with straight edges fill slightly less than the cylinder, and in the collapse the quarter is cut out of a mesh of
cubes; energies and moments are therefore compared per mass.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison, save_refinement
from common.files import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, GRAVITY, DENSITY = 1.0, 9.81, 2000.0  # m (the height, too), m/s2, kg/m3
ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
SAND = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=200.0, friction_angle=30.0)
REACH, HEADROOM = 2.5, 1.0  # of the mesh in which the sand collapses, over the radius and the height
DURATION = 0.8
"""Duration of the collapse [s]: 2.5 √(H/g)"""
PIC_FRACTION = 0.004  # of a critical step, as for dry grains
HALF, QUARTER = "half section", "quarter in three dimensions"


# --- 1. The elastic cylinder -----------------------------------------------------------------------------------------


def elastic(dim, cells):
    """Settlement of the top at the axis and at its edge, and widening at half the height [m]; cells: over the radius."""
    if dim == 2:
        mesh = bridge.box_mesh(MPI.COMM_WORLD, [RADIUS, RADIUS], [cells, cells])
        model = mpm.Model(bridge.background_mesh(*mesh), ELASTIC, geometry=mpm.Geometry.AXISYMMETRIC)
        base, symmetry = 3, {1: (1, 0)}
    else:
        parameters = {"radius": RADIUS, "height": RADIUS, "cell_size": RADIUS / cells}
        mesh = bridge.read_mesh(ROOT / "meshes" / "quarter_cylinder.geo", MPI.COMM_WORLD, 3, parameters)
        model = mpm.Model(bridge.background_mesh(*mesh), ELASTIC)
        base, symmetry = "base", {"x = 0": (1, 0, 0), "y = 0": (0, 1, 0)}
    model.seed(density=DENSITY, per_cell=3 if dim == 2 else 4)
    for tag, normal in symmetry.items():
        model.roller(tag, normal)
    model.fix(base)
    model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])
    list(model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    x, u = model.mesh.points, model.nodal("velocity")  # over one second
    places = np.zeros((3, dim))
    places[:, 0], places[:, -1] = (0.0, RADIUS, RADIUS), (RADIUS, RADIUS, 0.5 * RADIUS)
    moved = np.full((3, dim), np.inf)
    for row, place in zip(moved, places):
        node = np.flatnonzero(np.linalg.norm(x - place, axis=1) < 1e-6 * RADIUS)
        row[:] = u[node[0]] if len(node) else np.inf
    moved = np.min(model.comm.allgather(moved), axis=0)  # from whichever rank has the node
    return np.array([-moved[0, -1], -moved[1, -1], moved[2, 0]])


# --- 2. The collapse -------------------------------------------------------------------------------------------------


def collapsing(dim, cells):
    """Time, and per mass: mean radius and height [m], kinetic energy [J/kg]; (k, 4)."""
    comm, cell = MPI.COMM_WORLD, RADIUS / cells
    lengths = [REACH * RADIUS] * (dim - 1) + [HEADROOM * RADIUS + cell]
    counts = [round(length / cell) for length in lengths]
    mesh = bridge.background_mesh(*bridge.box_mesh(comm, lengths, counts, body=([-1.0] * dim, [RADIUS] * dim)))
    model = mpm.Model(mesh, SAND, geometry=mpm.Geometry.AXISYMMETRIC if dim == 2 else None)
    model.seed(density=DENSITY, per_cell=6 if dim == 2 else 8, cell_tag=bridge.BODY)
    model.remove(radius(model) > RADIUS)
    for axis in range(dim - 1):
        model.roller(2 * axis + 1, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])
    rows = [(0.0, *moments(model), 0.0)]
    for report in model.explicit(DURATION, every=DURATION / 20, pic=PIC_FRACTION):
        rows.append((report.time, *moments(model), report.kinetic_energy / report.mass))
    return np.array(rows)


def radius(model):
    """Distance of each particle of this rank from the axis [m]."""
    return np.linalg.norm(model.particles.position[:, : model.mesh.dim - 1], axis=1)


def moments(model):
    """Mean radius and height by mass [m]."""
    p = model.particles
    sums = model.comm.allreduce(np.array([p.mass.sum(), p.mass @ radius(model), p.mass @ p.position[:, -1]]))
    return sums[1:] / sums[0]


def run(quick: bool, folder) -> Result:
    # --- 3. Elastic: the difference decreases with the cell size -------------------------------------------------------------
    sizes, checks, errors = (4, 8) if quick else (4, 8, 12), [], {}
    found = {name: [elastic(dim, n) for n in sizes] for name, dim in ((HALF, 2), (QUARTER, 3))}
    for k, what in enumerate(
        ("settlement of the top's centre", "settlement of the top's edge", "widening at half the height")
    ):
        half, quarter = (np.array([values[k] for values in found[name]]) for name in (HALF, QUARTER))
        errors[what] = np.abs(quarter / half - 1)
        checks.append(Check(f"{what}, elastic, {sizes[-1]} cells", 1e3 * half[-1], "half section", 1e3 * quarter[-1],
                            0.04 if quick else 0.02, "mm"))  # fmt: skip
    total = [np.linalg.norm(np.array(a) / np.array(b) - 1) for a, b in zip(found[QUARTER], found[HALF])]
    checks.append(Check(f"difference with {sizes[-1]} cells over that with {sizes[0]}, elastic", sizes[0] / sizes[-1],
                        "at least in proportion to the cell size", total[-1] / total[0], 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 4. Collapse -------------------------------------------------------------------------------------------------
    sizes_of_sand = (4, 6) if quick else (4, 8, 12)
    sand = {name: [collapsing(dim, n) for n in sizes_of_sand] for name, dim in ((HALF, 2), (QUARTER, 3))}
    errors_of_sand = {}
    for k, what in ((1, "mean radius"), (2, "mean height"), (3, "kinetic energy")):
        scale = np.abs(sand[HALF][-1][:, k] - sand[HALF][-1][0, k]).max()
        gaps = [np.abs((a - a[0]) - (b - b[0]))[:, k].max() / scale for a, b in zip(sand[QUARTER], sand[HALF])]
        errors_of_sand[what] = gaps
        source = f"half section; largest difference up to {DURATION:g} s"
        checks.append(
            Check(
                f"difference of the {what}, collapse, {sizes_of_sand[-1]} cells",
                0.0,
                source,
                gaps[-1],
                (0.25 if quick else 0.1) if k == 3 else (0.06 if quick else 0.02),
                scale=1.0,
                over="the largest change",
            )
        )
    total = np.linalg.norm(list(errors_of_sand.values()), axis=0)
    checks.append(Check(f"difference with {sizes_of_sand[-1]} cells over that with {sizes_of_sand[0]}, collapse",
                        sizes_of_sand[0] / sizes_of_sand[-1], "at least in proportion to the cell size", total[-1] / total[0],
                        0.1, kind=Kind.AT_MOST))  # fmt: skip

    # --- 5. Pictures -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        save_refinement(
            folder / "elastic.png", sizes, "Cells over the radius", {"Quarter against half section": errors}
        )
        save_refinement(
            folder / "sand.png",
            sizes_of_sand,
            "Cells over the radius",
            {"Quarter against half section": errors_of_sand},
        )
        curves = {f"{name}, {what}": (rows[-1][:, 0], rows[-1][:, k] / RADIUS) for k, what in ((1, "radius"), (2, "height"))
                  for name, rows in sand.items()}  # fmt: skip
        save_comparison(
            folder / "collapse.png", curves, {}, ("Time [s]", "Mean by mass, over the radius [-]"), joined=True
        )
    return Result(checks, {
        "elastic.png": "Elastic cylinder: difference between the quarter and the half section over the number of cells",
        "sand.png": "Collapse of a cylinder of sand: largest difference between both over the number of cells",
        "collapse.png": "Collapse of a cylinder of sand: mean radius and height of the quarter and of the half section",
    })  # fmt: skip
