"""Warnings of rock by Hoek and Brown whose strength or stiffness is probably in another unit."""

from __future__ import annotations

from typing import Any

from mpm_core.law_warnings import with_inner_laws

import mpm_core as mpm

WEAKEST, STRONGEST = 0.25e6, 500e6
"""Uniaxial compressive strengths [Pa] of rock: the least of extremely weak rock (ISRM 1981), and one above those of basalt and quartzite"""

SOFTEST = 1.0
"""Young's modulus of a rock mass over the intact strength below which it is doubted. Samples have 200 and more (Deere 1968), and a rock mass at least
0.02 of that (Hoek and Diederichs 2006), so that 4 is the least"""

OTHER_UNIT = 1e5
"""Young's modulus [Pa] below which it is doubted for all laws, in `unit_doubt`"""


def rock_doubt(law: Any, where: str) -> str:
    """A warning of an intact strength that rock does not have, or of a rock mass that is too soft for it; empty for others, and for other laws.

    Args:
        law: any law.
        where: its parameters stand, for the message.
    """
    rock = next((one for one in with_inner_laws(law) if isinstance(one, mpm.HoekBrown)), None)
    if rock is None:
        return ""
    strength = rock.intact_strength
    if not WEAKEST <= strength <= STRONGEST:
        return (
            f"{where}: intact_strength is {strength:g} Pa, expected that of rock samples, {WEAKEST:g} to {STRONGEST:g} Pa: strengths are in Pa, such as "
            "25e6 for 25 MPa"
        )
    if OTHER_UNIT <= rock.young < SOFTEST * strength:
        return (
            f"{where}: young is {rock.young:g} Pa, less than the intact_strength of {strength:g} Pa; rock masses have at least some 4 times as much: "
            "moduli are in Pa, such as 3e9 for 3 GPa"
        )
    return ""
