"""Structural members: the lining of a tunnel in elastic ground, and an anchor that is pulled out.

Ground under the vertical pressure P and the horizontal one K P is excavated inside of a circular lining, which is bonded to it
(Einstein and Schwartz 1979, J. Geotech. Eng. Div. ASCE 105, 499-518, full bond). The half section is meshed; the lining is clamped
where the axis of symmetry cuts it. The anchor and a soft spring hold a block on rollers: the grouted
body of the anchor slips under the strength of the bond times its length.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from _case import STUDIES, Check, Result
from _plots import save_comparison
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, YOUNG, POISSON = 0.5, 50e6, 0.3  # m, Pa, -
PRESSURE, RATIO = 200e3, 0.5  # Pa, - (horizontal over vertical)
AXIAL, BENDING = 0.9e9, 0.3e6  # E A [N/m] and E I [N m2/m] of the lining
BOND, BODY = 4e3, 1.5  # N/m2, m
SOURCE = "Einstein and Schwartz (1979), full bond"


def lining_forces(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axial force [N/m], compression positive, and moment [N m/m], positive where the outside is compressed.

    Args:
        angle: from the horizontal [rad].
    """
    c = YOUNG * RADIUS / (AXIAL * (1 - POISSON**2))
    f = YOUNG * RADIUS**3 / (BENDING * (1 - POISSON**2))
    a0 = c * f * (1 - POISSON) / (c + f + c * f * (1 - POISSON))
    beta = ((6 + f) * c * (1 - POISSON) + 2 * f * POISSON) / (3 * f + 3 * c + 2 * c * f * (1 - POISSON))
    b2 = c * (1 - POISSON) / (2 * (c * (1 - POISSON) + 4 * POISSON - 6 * beta - 3 * beta * c * (1 - POISSON)))
    a2 = beta * b2
    turning = np.cos(2 * angle)
    thrust = 0.5 * (1 + RATIO) * (1 - a0) + 0.5 * (1 - RATIO) * (1 + 2 * a2) * turning
    moment = -0.25 * (1 - RATIO) * (1 - 2 * a2 + 2 * b2) * turning
    return PRESSURE * RADIUS * thrust, PRESSURE * RADIUS**2 * moment


def lined_tunnel(size: float, edge_size: float, deconfinement: float | None = None) -> mpm.MemberForces:
    """Forces in the lining from crown to invert.

    size: half of the width of the ground [m]; edge_size: of cells at the lining [m]; deconfinement: fraction of the forces of the core that is
    released before the lining comes, None for a lining that comes with the excavation
    """
    mesh = bridge.read_mesh(
        Path(STUDIES).parent / "meshes" / "pipe.geo", MPI.COMM_WORLD,
        parameters={"size": size, "edge_size": edge_size, "far_size": size / 8},
    )  # fmt: skip
    soil, supports = mpm.LinearElastic(young=YOUNG, poisson=POISSON), [
        bridge.roller("axis", (1, 0)),
        bridge.fixed("far"),
    ]
    site = bridge.FemSite(bridge.QuasiStatic(mesh[0], soil, mesh[2], supports, cell_tags=mesh[1]))
    in_situ = -PRESSURE * np.array([RATIO, 1.0, POISSON * (1 + RATIO), 0.0])
    angle = np.linspace(0.5, -0.5, 37) * np.pi
    line = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    line[[0, -1], 0] = 0.0
    lining = mpm.beam(line, AXIAL, BENDING, clamped_start=True, clamped_end=True)
    weights = {"soil": 0.0, "pipe": 0.0}
    stages = [
        bridge.Stage(
            "in situ", fill=list(weights), unit_weight=weights, stress=lambda x: np.tile(in_situ, (len(x), 1))
        ),
        bridge.Stage("tunnel", excavate="pipe", reset_displacement=True, deconfinement=deconfinement or 1.0),
        bridge.Stage("lining", install={"lining": lining}),
    ]
    if deconfinement is None:
        stages[1:] = [replace(stages[1], install=stages[2].install)]
    list(bridge.carry_out(site, stages))
    return site.fem.member_forces("lining")


def pulled_anchor(cells: int, load: float) -> mpm.MemberForces:
    """Forces in an anchor that holds a block on rollers against a load [N/m], beside a soft spring; cells: per metre."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (4.0, 2.0), (4 * cells, 2 * cells))
    numbers = np.arange(bridge.original_cells(domain).size, dtype=np.int32)
    x = compute_midpoints(domain, 2, numbers)[:, 0]
    tags = meshtags(domain, 2, numbers, np.where(x < 1, 1, np.where(x < 1.5, 2, 3)).astype(np.int32))
    soil, supports = mpm.LinearElastic(young=20e6, poisson=0.3), [bridge.fixed(1), bridge.roller(3, (0, 1))]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=tags)
    anchor = mpm.bar([(0.7, 1.0), (2.0 + BODY, 1.0)], 100e6, bond_strength=BOND, free_length=1.3, connected=True)
    spring = mpm.strut((3.8, 1.0), (0.5, 1.0), 1e6)
    fem.reconfigure(off=[2], members={"anchor": anchor, "spring": spring})
    fem.solve(bridge.Load(traction={2: (load / 2.0, 0.0)}))
    return fem.member_forces("anchor")


def run(quick: bool, folder) -> Result:
    # --- 1. The lining -----------------------------------------------------------------------------------------------
    forces = lined_tunnel(*((6.0, 0.06) if quick else (12.0, 0.03)))
    nodes = forces.positions
    middles = (nodes[1:] + nodes[:-1]) / 2
    at_nodes, at_middles = (np.arctan2(x[:, 1], x[:, 0]) for x in (nodes, middles))
    thrust, moment = lining_forces(at_middles)[0], lining_forces(at_nodes)[1]
    side, tolerance = len(nodes) // 2, 0.05 if quick else 0.03
    checks = [
        Check("axial force of the lining at the crown", thrust[0], SOURCE, -forces.axial_force[0], tolerance, "N/m"),
        Check("axial force at the side", thrust[side], SOURCE, -forces.axial_force[side], tolerance, "N/m"),
        Check("moment at the crown", moment[0], SOURCE, forces.moment[0], tolerance, "N m/m"),
        Check("moment at the side", moment[side], SOURCE, forces.moment[side], tolerance, "N m/m"),
    ]

    # --- 2. The anchor -----------------------------------------------------------------------------------------------
    pulled = pulled_anchor(4 if quick else 8, load=1.5 * BOND * BODY)
    checks.append(
        Check("force of an anchor that is pulled out", BOND * BODY, "bond strength times length of its body",
              pulled.axial_force[0], 1e-3, "N/m")
    )  # fmt: skip
    if MPI.COMM_WORLD.rank == 0:
        shown = np.linspace(-90, 90, 181)
        exact_thrust, exact_moment = lining_forces(np.radians(shown))
        scale = PRESSURE * RADIUS
        computed = {
            "axial force / PR": (np.degrees(at_middles), -forces.axial_force / scale),
            "20 moment / PR²": (np.degrees(at_nodes), 20 * forces.moment / (scale * RADIUS)),
        }
        expected = {
            "Einstein and Schwartz, axial force": (shown, exact_thrust / scale),
            "Einstein and Schwartz, moment": (shown, 20 * exact_moment / (scale * RADIUS)),
        }
        labels = "Angle from the horizontal [degrees]", "Force over that of the ground [-]"
        save_comparison(folder / "lining.png", computed, expected, labels)
    return Result(
        checks,
        {"lining.png": "Axial force (compression positive) and moment of a tunnel lining around its half section"},
    )
