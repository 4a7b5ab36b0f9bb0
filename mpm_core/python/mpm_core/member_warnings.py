"""Warnings of structural members that are probably in other units, stiffer than meant, or in no soil."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .members import Member

if TYPE_CHECKING:
    from .model import Model

SOFTEST_BEAM = 5e7
"""Young's modulus [Pa] of a plate as stiff as a beam, below which its stiffness is more probably in kN: sheet piles have some 5e9,
concrete 3e10, and piles far apart 1e9"""

SOFTEST_BAR = 5e4
"""Axial stiffness [N/m] below which that of a bar or strut is more probably in kN: weak geogrids have 2e5"""

SOFTEST_STRUT = 1e6
"""The same of a strut or tie, which is of steel, concrete or wood: a tie rod of 20 mm every 3 m has 2e7"""

STIFFEST_BEAM = 2.5e11
"""Young's modulus [Pa] of a plate as stiff as a beam, above which its bending stiffness is more probably in kN m2/m: steel has 2.1e11"""

LEAST_PRESTRESS = 1e3
"""Prestress [N/m] below which it is more probably in kN/m, where it is below `LEAST_STRAIN` too: those of struts and anchors have tens of kN/m"""

LEAST_BOND = 500.0
"""Bond strength [N/m2] below which it is more probably in kN/m2: that of a weak nail every 2 m has 3e3"""

LEAST_STRAIN = 1e-5
"""Strain at which a member yields, below which its strength is more probably in kN: steel yields at some 1e-3, and concrete cracks at
1e-4"""

MOST_RIGID = 0.1
"""Fraction of the nodes of a beam, at most, at which it may be unable to bend [-]: it is as much stiffer than it should be"""


def leaking(name: str, member: Member, model: Model) -> str:
    """What a warning says of a wall that holds water back, which it does not in the pore water of particles; empty for others."""
    if not member.impervious or model._core.water is None:
        return ""
    return (
        f"water flows through the beam {name!r}, which is impervious: members of particles do not hold their pore water back. Particles "
        "with Undrained laws, whose water does not flow, keep the pressures of finite elements on both sides"
    )


def odd_units(name: str, member: Member) -> list[str]:
    """What warnings say of stiffness and strength that are probably not in N; empty for others."""
    stiffness, bending = member.axial_stiffness, member.bending_stiffness
    found = []
    thickness = math.sqrt(12 * bending / stiffness)
    if bending and stiffness / thickness < SOFTEST_BEAM:
        found.append(
            f"the beam {name!r} is as stiff as a plate {thickness:.3g} m thick with a Young's modulus of {stiffness / thickness:.3g} Pa, "
            "less than that of any wall: axial_stiffness is in N/m and bending_stiffness in N m2/m, not in kN"
        )
    if bending and stiffness / thickness > STIFFEST_BEAM:
        found.append(
            f"the beam {name!r} is as stiff as a plate {thickness:.3g} m thick with a Young's modulus of {stiffness / thickness:.3g} Pa, "
            "more than that of steel: bending_stiffness is in N m2/m as axial_stiffness is in N/m, not in kN m2/m"
        )
    softest, of_any = (SOFTEST_BAR, "geogrid") if member.bonded else (SOFTEST_STRUT, "strut or tie")
    if not bending and stiffness < softest:
        found.append(
            f"axial_stiffness of the member {name!r} is {stiffness:g} N/m, less than that of any {of_any}; it is in N/m, not in kN/m"
        )
    if 0 < abs(member.prestress) < min(LEAST_PRESTRESS, LEAST_STRAIN * stiffness):
        found.append(
            f"prestress of the member {name!r} is {member.prestress:g} N/m, which hardly stresses it; it is in N/m, not in kN/m"
        )
    if 0 < member.bond_strength < LEAST_BOND:
        found.append(
            f"bond_strength of the member {name!r} is {member.bond_strength:g} N/m2, less than that of any nail or geogrid; it is in N/m2, "
            "not in kN/m2"
        )
    strains = {
        "tensile_strength": member.tensile_strength / stiffness,
        "compressive_strength": member.compressive_strength / stiffness,
    }
    if bending:
        strains["plastic_moment"] = member.plastic_moment / bending * thickness / 2
    for key, strain in strains.items():
        if 0 < strain < LEAST_STRAIN:
            unit = "N m/m" if key == "plastic_moment" else "N/m"
            found.append(
                f"{key} of the member {name!r} is {getattr(member, key):g} {unit}, so that it yields at a strain of {strain:.1g}, less "
                f"than any material; it is in {unit}, not in k{unit}"
            )
    return found


def rigid_beam(name: str, fraction: float, cells: str) -> str:
    """What a warning says of a beam that cannot bend at a fraction of its nodes, for its cells only turn as a whole; empty for others."""
    if fraction <= MOST_RIGID:
        return ""
    return (
        f"the beam {name!r} cannot bend at {fraction:.0%} of its nodes, which lie inside of {cells} with both nodes beside, so that it is "
        "too stiff and its moments are wrong: give it a larger spacing, of the length of the cells there, or none"
    )


def rigid_fraction(model: Model, nodes: NDArray[np.float64]) -> float:
    """Fraction of the inner nodes (n, 2) [m] of a beam at which it cannot bend, as both segments beside are in one cell [-]. Collective."""
    middles, edges = (nodes[1:] + nodes[:-1]) / 2, np.diff(nodes, axis=0)
    across = 1e-6 * np.column_stack([-edges[:, 1], edges[:, 0]])
    inside = np.zeros(len(middles) - 1, dtype=bool)
    for side in (across, -across):  # a line that the mesh follows lies between two cells
        cells = model.mesh.cells_of(middles + side)
        cells[cells >= model.mesh.owned_cells] = -1
        inside |= (cells[1:] == cells[:-1]) & (cells[1:] >= 0)
    return float(np.mean(model.comm.allreduce(inside.astype(int)) > 0))


def members_in_air(model: Model) -> str:
    """What a warning says of members that carry nothing, as there is no soil around their nodes; empty without any. Collective."""
    for name, member in model.members.items():
        places = model.member_forces(name).places
        nodes = places[:-1] if member.fixed_end else places
        in_air = ~_in_soil(model, nodes)
        if in_air.all() or (not member.bonded and in_air.any()):
            where = ", ".join(f"{x:.6g}" for x in nodes[int(np.argmax(in_air))])
            return f"the member {name!r} carries nothing: there is no soil at ({where}) m"
    return ""


def _in_soil(model: Model, points: NDArray[np.float64]) -> Any:
    """Whether points (n, D) [m] are in cells of which a node has soil around it, (n,). Collective."""
    mesh, numbers = model.mesh, np.asarray(model.mesh.global_nodes)
    cells = mesh.cells_of(points)
    mine = np.flatnonzero((cells >= 0) & (cells < mesh.owned_cells))
    found = model.comm.allgather((mine, numbers[mesh.cells[cells[mine]]]))
    here = np.unique(numbers[mesh.cells[np.unique(model.particles.cell)]])
    in_soil = np.zeros(len(points), dtype=bool)
    for rows, nodes in found:
        in_soil[rows] |= np.isin(nodes, here).any(axis=1)
    return model.comm.allreduce(in_soil.astype(int)) > 0
