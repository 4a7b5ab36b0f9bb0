"""Tunnels by the convergence-confinement method: a stage releases a part of the forces of the core, then the lining comes.

Panet (1995, Le calcul des tunnels par la méthode convergence-confinement). The wall without lining goes along the ground reaction curve of
Mohr-Coulomb ground under a hydrostatic stress (Salençon 1969, Int. J. Rock Mech. Min. Sci. 6, 231-236; Carranza-Torres 2003, ibid. 40, 629-639), and
a lining ends where its own stiffness meets this curve. In elastic ground under unequal stresses the wall converges by the part of Kirsch's
displacements that is released, and the lining bears the rest of the forces of Einstein and Schwartz (1979, J. Geotech. Eng. Div. ASCE 105, 499-518).
"""

from pathlib import Path

import members
import numpy as np
from _case import STUDIES, Check, Result
from _ground_reaction import Ground
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

GROUND = Ground(3.0, np.inf, 400e3, young=100e6, poisson=0.3, cohesion=50e3, friction_angle=22.0, dilation_angle=5.0)
RELEASED, LINED = (0.2, 0.4, 0.6, 0.75, 0.85), (0.5, 0.7)  # fractions at the wall, and when a lining comes
AXIAL, BENDING = 1.0e9, 2.0e6  # E A [N/m] and E I [N m2/m] of the lining, 0.1 m of young shotcrete of 10 GPa with ribs
RATIO, PART = 0.5, 0.4  # horizontal over vertical stress, and the part that is released, in elastic ground
CURVE = "Salençon (1969), Carranza-Torres (2003)"


def site(size: float, edge_size: float, law, ratio: float) -> bridge.FemSite:
    """The ground before the tunnel.

    size: half of the width [m]; edge_size: of cells at the wall [m]; ratio: horizontal over vertical stress
    """
    domain, cell_tags, facet_tags = bridge.read_mesh(
        Path(STUDIES).parent / "meshes" / "pipe.geo", MPI.COMM_WORLD,
        parameters={"radius": GROUND.radius, "size": size, "edge_size": edge_size, "far_size": size / 8},
    )  # fmt: skip
    supports = [bridge.roller("axis", (1, 0)), bridge.fixed("far")]
    ground = bridge.FemSite(bridge.QuasiStatic(domain, law, facet_tags, supports, cell_tags=cell_tags))
    along = 1.0 if ratio == 1 else GROUND.poisson * (1 + ratio)
    stress = -GROUND.pressure * np.array([ratio, 1.0, along, 0.0])
    weights = {"soil": 0.0, "pipe": 0.0}
    ground.carry_out(
        bridge.Stage("in situ", fill=list(weights), unit_weight=weights, stress=lambda x: np.tile(stress, (len(x), 1)))
    )
    return ground


def lining(ground: bridge.FemSite) -> mpm.Member:
    """The half ring of a lining through the nodes of the mesh, whose ends are on the axis of symmetry. Collective."""
    x, y = ground.fem.domain.geometry.x[:, :2].T
    here = np.arctan2(y, x)[abs(np.hypot(x, y) - GROUND.radius) < 1e-6 * GROUND.radius]
    angle = np.unique(np.concatenate(ground.fem.domain.comm.allgather(here)).round(9))[::-1]
    line = GROUND.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    line[[0, -1], 0] = 0.0
    return mpm.beam(line, AXIAL, BENDING, clamped_start=True, clamped_end=True)


def movements(ground: bridge.FemSite) -> tuple[float, float]:
    """Inward displacements of the crown and of the side [m]."""
    moved = ground.fem.evaluate_at(GROUND.radius * (1 + 1e-9) * np.array([(0.0, 1.0), (1.0, 0.0)]))["displacement"]
    return -moved[0, 1], -moved[1, 0]


def dug(released: float) -> bridge.Stage:
    """The stage that digs the core away."""
    return bridge.Stage("core", excavate="pipe", reset_displacement=True, deconfinement=released)


def run(quick: bool, folder) -> Result:
    size, edge_size, tolerance = (60.0, 0.36, 0.03) if quick else (120.0, 0.18, 0.01)
    names = ("young", "poisson", "cohesion", "friction_angle", "dilation_angle")
    soil = mpm.MohrCoulomb(**{name: getattr(GROUND, name) for name in names})
    checks = []

    # --- 1. The ground reaction curve, each point of it from the one before ------------------------------------------
    ground, computed, held = site(size, edge_size, soil, 1.0), [], 1.0
    for k, released in enumerate(RELEASED):
        part = 1 - (1 - released) / held  # of what is still held
        ground.carry_out(dug(part) if k == 0 else bridge.Stage("further", deconfinement=part))
        held, support = 1 - released, (1 - released) * GROUND.pressure
        computed.append((float(np.mean(movements(ground))), support))
        checks.append(Check(f"convergence of the wall, {released:.0%} released", 1e3 * GROUND.wall(support), CURVE,
                            1e3 * computed[-1][0], tolerance, "mm"))  # fmt: skip

    # --- 2. A lining that comes on this curve ------------------------------------------------------------------------
    stiffness, equilibria = AXIAL / GROUND.radius**2, []
    for released in LINED:
        ground = site(size, edge_size, soil, 1.0)
        ground.carry_out(dug(released))
        ground.carry_out(bridge.Stage("lining", install={"lining": lining(ground)}))
        thrust = -float(np.mean(ground.fem.member_forces("lining").axial_force))
        equilibria.append((float(np.mean(movements(ground))), thrust / GROUND.radius))
        expected = GROUND.lined(released, stiffness) * GROUND.radius
        checks.append(Check(f"axial force of a lining after {released:.0%}", 1e-3 * expected, "ground reaction curve and stiffness of the lining",
                            1e-3 * thrust, tolerance, "kN/m"))  # fmt: skip

    # --- 3. Elastic ground under unequal stresses --------------------------------------------------------------------
    ground = site(size, edge_size, mpm.LinearElastic(young=GROUND.young, poisson=GROUND.poisson), RATIO)
    ground.carry_out(dug(PART))
    scale = PART * GROUND.pressure * GROUND.radius / (2 * GROUND.shear)
    mean, unequal = 0.5 * (1 + RATIO), 0.5 * (1 - RATIO) * (3 - 4 * GROUND.poisson)
    for where, expected, moved in zip(("crown", "side"), (mean + unequal, mean - unequal), movements(ground)):
        checks.append(Check(f"convergence of the {where}, elastic, K = {RATIO}, {PART:.0%} released", 1e3 * scale * expected, "Kirsch (1898)",
                            1e3 * moved, tolerance, "mm", scale=1e3 * scale, over="0.4 P R / 2 G"))  # fmt: skip
    forces = members.lined_tunnel(*((6.0, 0.06) if quick else (12.0, 0.03)), deconfinement=PART)
    at_crown, at_side = members.lining_forces(np.array([0.5 * np.pi, 0.0]))[0] * (1 - PART)
    moment = members.lining_forces(np.zeros(1))[1][0] * (1 - PART)
    side, near = len(forces.positions) // 2, 0.05 if quick else 0.03
    source = f"{1 - PART:g} of Einstein and Schwartz (1979), full bond"
    checks += [
        Check("axial force of the lining at the crown", at_crown, source, -forces.axial_force[0], near, "N/m"),
        Check("axial force at the side", at_side, source, -forces.axial_force[side], near, "N/m"),
        Check("moment at the side", moment, source, forces.moment[side], near, "N m/m"),
    ]
    if MPI.COMM_WORLD.rank == 0:
        pressures = np.linspace(0.12, 1.0, 200) * GROUND.pressure
        curve = np.array([GROUND.wall(pressure) for pressure in pressures])
        lines = {"ground reaction curve": (1e3 * curve, 1e-3 * pressures)}
        for released in LINED:
            begin = GROUND.wall((1 - released) * GROUND.pressure)
            beyond = GROUND.lined(released, stiffness) * 1.3
            shown = np.array([0.0, beyond])
            lines[f"lining after {released:.0%}"] = (1e3 * (begin + shown / stiffness), 1e-3 * shown)
        points = {"without lining": computed, "with lining": equilibria}
        save_comparison(
            folder / "curve.png", {name: (1e3 * np.array(p)[:, 0], 1e-3 * np.array(p)[:, 1]) for name, p in points.items()},
            lines, ("Convergence of the wall [mm]", "Pressure on the wall [kPa]"), limits=((0, None), (0, None)),
        )  # fmt: skip
    return Result(
        checks,
        {
            "curve.png": "Ground reaction curve of a tunnel: pressure that stages still hold, and that of a lining which comes later"
        },
    )
