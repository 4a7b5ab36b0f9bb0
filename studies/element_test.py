"""Laboratory tests on one point of any law: oedometer, triaxial drained and undrained, simple shear, cycles; stress paths.

The undrained triaxial test and cyclic tests keep the volume constant. Cyclic tests load to and fro between two stresses until
the strain or the number of cycles is reached. With --undrained the law itself includes pore water, and the excess pore
pressure is drawn. A law of your own is given by --python-law FILE.py:CLASS, or by --umat LIBRARY.so with its PROPS.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from common.checks import check_effect, low_pressure, say
from common.cyclic_loading import CYCLIC, amplitude, cycles, draw_cycles, first_cycle
from common.figures import curve_figure
from common.history import History
from common.options import add_choice, add_count, add_number, check, study_parser
from common.ranks import run_study
from common.results import open_results
from common.slope.case import add_soil_options
from common.soils import add_law_options, check_law_options, law_of
from common.summary import write_summary
from mpm_core.law_warnings import angles_in_radians

import mpm_core as mpm

SOFTEST = 10e3
"""Oedometric modulus [Pa] below which there is no soil: mud has some 50 kPa"""
OWN_STIFFNESS = ("cam-clay", "nor-sand", "sanisand", "hardening-soil")
"""Laws whose stiffness follows from the pressure"""
PRECONSOLIDATED = {"cam-clay": ("--preconsolidation", 1.0), "nor-sand": ("--image-pressure", np.e)}
"""Laws that yield under an isotropic pressure, the options that set it, and how many times their value it is, attraction included"""
TESTS = ("oedometer", "drained", "undrained", "shear", *CYCLIC)
COLUMNS = ["axial_strain", "shear_strain", "volumetric_strain", "p_Pa", "q_Pa", "shear_stress_Pa",
           "excess_pore_pressure_Pa", "plastic_strain", "axial_stress_Pa", "lateral_stress_Pa"]  # fmt: skip
OF_CYCLES = ["cycles", "axial_difference_Pa"]
"""Columns of cyclic tests only"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_choice(p, "--test", "drained", TESTS, "compression without lateral strain; triaxial with constant lateral "
               "stress; triaxial at constant volume; simple shear at constant volume; cycles of these two")  # fmt: skip
    add_number(p, "--pressure", 20e3, "Pa", "isotropic pressure at the start", at_least=0)
    add_number(p, "--strain", 0.2, "-", "axial strain to reach (shear strain in simple shear), in compression; single "
               "amplitude with which cyclic tests end", above=0)  # fmt: skip
    add_count(p, "--steps", 400, "increments; cyclic tests choose theirs by the change of the stress")
    add_number(p, "--stress-ratio", 0.2, "-", "amplitude of cycles: shear stress, or half the difference of axial and lateral "
               "stress, over the pressure at the start", above=0)  # fmt: skip
    add_count(p, "--cycles", 100, "number of cycles after which a cyclic test ends")
    add_number(p, "--rate", None, "1/s", "rate of this strain, for laws that depend on time; without one the test is infinitely "
               "slow", above=0)  # fmt: skip
    add_soil_options(p, dilation_angle=0.0)
    add_law_options(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check_law_options(p, a)
    cyclic = a.test in CYCLIC
    check_effect(p, a, cyclic, ("--stress-ratio", "--cycles"), f"--test {' or '.join(CYCLIC)}")
    check_effect(p, a, not cyclic, ("--steps", "--rate"), "a test without cycles")
    check(p, not cyclic or a.pressure > 0,
          lambda: f"--pressure is {a.pressure:g} Pa, expected above 0 for cycles of --stress-ratio times the pressure")  # fmt: skip
    own = bool(a.python_law or a.umat)
    creeps = a.material == "cam-clay" and a.creep > 0
    check_effect(p, a, own or creeps or a.material == "viscoplastic", ("--rate",),
                 "--material viscoplastic, --material cam-clay and --creep, --python-law or --umat")  # fmt: skip
    check(p, own or a.material != "viscoplastic" or a.rate is not None,
          "--material is viscoplastic, expected --rate with it: in an infinitely slow test the viscosity has no effect")  # fmt: skip
    lacking = "0 for cycles, which have" if cyclic else "--rate with it: without one, the test has"
    check(p, own or not creeps or a.rate is not None,
          lambda: f"--creep is {a.creep:g}, expected {lacking} no duration, so that the soil does not creep")  # fmt: skip
    say(in_percent(a))
    say(low_pressure("--pressure", a.pressure))
    return a


def in_percent(a: Namespace) -> str:
    """What a warning says of a strain that is probably in percent; empty for others. Simple shear may go far."""
    if a.strain <= (5.0 if "shear" in a.test else 1.0):
        return ""
    return f"--strain is {a.strain:g}, a fraction: {a.strain:g} % are {a.strain / 100:g}"


def too_soft(a: Namespace, law: Any) -> str:
    """What a warning says of a stiffness that is probably not in Pa; empty for others."""
    if law.p_wave_modulus >= max(SOFTEST, a.pressure):
        return ""
    return (
        f"the oedometric modulus of the soil is {law.p_wave_modulus:.4g} Pa, under a pressure of {a.pressure:g} Pa: moduli are in Pa, "
        "200e3 and more for most soils"
    )


def not_yielded(a: Namespace, plastic_strain: float) -> str:
    """What a warning says of a test that ends before the soil yields; empty for others, and for laws of one's own.

    Soil need not yield in an oedometer, because of its lateral stress, nor in cycles.
    """
    own = a.python_law or a.umat
    if own or a.material == "elastic" or a.test in ("oedometer", *CYCLIC) or plastic_strain > 0:
        return ""
    stiffness = f" or --young, {a.young:g} Pa" * (a.material not in OWN_STIFFNESS)
    return (
        f"the soil has not yielded at --strain {a.strain:g}, so that q is not its strength: raise --strain{stiffness}"
    )


def check_start(a: Namespace, law: Any) -> None:
    """End with an error where the soil cannot be under the pressure at the start: without a strain, its law would change the stress.

    Raises:
        InputError: --pressure is outside of the yield surface.
    """
    if a.python_law or a.umat or a.material not in PRECONSOLIDATED:
        return
    test = mpm.ElementTest(law, [-a.pressure] * 3 + [0.0] * 3)
    with suppress(mpm.RunError):
        test.step([0.0] * 6, dt=np.inf)
    if np.abs(test.stress[:3] + a.pressure).max() > 1e-6 * a.pressure:
        name, times = PRECONSOLIDATED[a.material]
        value, least = getattr(a, name[2:].replace("-", "_")), (a.pressure + a.attraction) / times - a.attraction
        raise mpm.InputError(
            f"--pressure is {a.pressure:g} Pa, expected one inside of the yield surface; {name} is {value:g} Pa, raise it to {np.ceil(least):g} Pa "
            "or more"
        )


def never_cycled(a: Namespace, number: float) -> str:
    """What a warning says of a cyclic test without a cycle; empty for others."""
    if a.test not in CYCLIC or number > 0:
        return ""
    return (
        f"--stress-ratio is {a.stress_ratio:g}, more than the soil carries: it reached --strain {a.strain:g} in the first loading, without a "
        "cycle"
    )


# --- 2. The test -----------------------------------------------------------------------------------------------------


def increment(kind: str, size: float) -> list[float | None]:
    """Strain increment of a test, None where the stress is kept; x is the axis."""
    return {
        "oedometer": [-size, 0.0, 0.0, 0.0, 0.0, 0.0],
        "drained": [-size, None, None, 0.0, 0.0, 0.0],
        "undrained": [-size, size / 2, size / 2, 0.0, 0.0, 0.0],
        "shear": [0.0, 0.0, 0.0, size, 0.0, 0.0],
    }[kind.removeprefix("cyclic-").replace("triaxial", "undrained")]


def row(test: mpm.ElementTest) -> dict[str, float]:
    """Quantities of interest: of the effective stress where there is pore water, else of the stress, in compression."""
    names = test.law.state_names
    pore = test.state[names.index("excess_pore_pressure")] if "excess_pore_pressure" in names else 0.0
    p = -test.stress[:3].mean()
    s = test.stress + p * np.array([1, 1, 1, 0, 0, 0])
    q = np.sqrt(1.5 * ((s[:3] ** 2).sum() + 2 * (s[3:] ** 2).sum()))
    return {
        "axial_strain": -test.strain[0], "shear_strain": test.strain[3], "volumetric_strain": -test.strain[:3].sum(),
        "p_Pa": p - pore, "q_Pa": q, "shear_stress_Pa": test.stress[3], "excess_pore_pressure_Pa": pore,
        "plastic_strain": test.state[0], "axial_stress_Pa": -test.stress[0] - pore,
        "lateral_stress_Pa": -test.stress[1:3].mean() - pore,
    }  # fmt: skip


def run(test: mpm.ElementTest, a: Namespace, history: History) -> str | None:
    """Apply all increments; returns why the test ended early, if it did."""
    if a.test in CYCLIC:
        return run_cycles(test, a, history)
    history.add(**row(test))
    size = a.strain / a.steps
    for _ in range(a.steps):
        try:
            test.step(increment(a.test, size), dt=np.inf if a.rate is None else size / a.rate)
        except mpm.RunError as error:
            return str(error)
        history.add(**row(test))
    return None


def run_cycles(test: mpm.ElementTest, a: Namespace, history: History) -> str | None:
    """Apply all cycles; returns why the test ended early, if it did."""

    def add(number: float) -> None:
        history.add(**row(test), cycles=number, axial_difference_Pa=2 * amplitude("cyclic-triaxial", test.stress))

    add(0.0)
    try:
        for number in cycles(test, a.test, partial(increment, a.test), a.stress_ratio * a.pressure, a.strain, a.cycles):
            add(number)
    except mpm.RunError as error:
        return str(error)
    return None


def stiffness(history: History) -> dict[str, float | None]:
    """Of an oedometer test: ratio of lateral to axial stress in the end, and tangent modulus of the last increment [Pa]."""
    axial, lateral, strain = (history[name] for name in ("axial_stress_Pa", "lateral_stress_Pa", "axial_strain"))
    ratio = float(lateral[-1] / axial[-1]) if axial[-1] != 0 else None
    modulus = float((axial[-1] - axial[-2]) / (strain[-1] - strain[-2])) if len(axial) > 1 else None
    return {"lateral_over_axial_stress": ratio, "tangent_oedometer_modulus_Pa": modulus}


def milestones(history: History, a: Namespace) -> dict[str, float | None]:
    """Numbers of cycles until soil counts as liquefied, by the usual criteria; None where it does not."""
    strain = history["shear_strain" if a.test == "cyclic-shear" else "axial_strain"]
    return {
        "cycles_to_excess_pore_pressure_ratio_0.9": first_cycle(history, history["p_Pa"] < 0.1 * a.pressure),
        "cycles_to_strain_0.025": first_cycle(history, np.abs(strain) > 0.025),
    }


# --- 3. Pictures and the end -----------------------------------------------------------------------------------------


def draw(history: History, a: Namespace, path: Path) -> None:
    """Stress path, stress over strain, and volume over strain, or pore pressure, or the mean stress where volume is kept.

    In an oedometer the volumetric strain is the axial one, and is drawn over the axial stress.
    """
    if a.test in CYCLIC:
        return draw_cycles(history, a.test, path)
    shear = a.test == "shear"
    strain = history["shear_strain" if shear else "axial_strain"]
    strain_label = "Shear strain [-]" if shear else "Axial strain, compression [-]"
    if np.any(history["excess_pore_pressure_Pa"] != 0):
        last = ("excess_pore_pressure_Pa", 1e-3, "Excess pore pressure [kPa]")
    elif np.abs(history["volumetric_strain"]).max() < 1e-9:
        last = ("p_Pa", 1e-3, "$p'$ [kPa]")  # the volume is kept
    else:
        last = ("volumetric_strain", 1.0, "Volumetric strain, compression [-]")
    third = strain, history[last[0]] * last[1], strain_label, last[2]
    if a.test == "oedometer" and last[0] == "volumetric_strain":
        third = history["axial_stress_Pa"] * 1e-3, strain, "Axial stress [kPa]", strain_label
    panels = [
        (history["p_Pa"] * 1e-3, history["q_Pa"] * 1e-3, "$p'$ [kPa]", "$q$ [kPa]"),
        (
            strain,
            history["shear_stress_Pa" if shear else "q_Pa"] * 1e-3,
            strain_label,
            "Shear stress [kPa]" if shear else "$q$ [kPa]",
        ),
        third,
    ]
    with curve_figure(path, (10, 3.2), panels=3) as axes:
        for ax, (x, y, x_label, y_label) in zip(axes, panels, strict=True):
            ax.plot(x, y, color="#1f3b73")
            ax.plot(x[:1], y[:1], "o", color="black", markersize=4, markerfacecolor="white", clip_on=False, zorder=3)
            ax.set_xlabel(x_label)
            ax.set_ylabel(y_label)
            ax.set_ylim(min(0.0, 1.05 * y.min()), max(1.05 * y.max(), 1e-12))
        axes[0].set_xlim(
            min(0.0, 1.05 * axes[0].dataLim.x0), 1.05 * axes[0].dataLim.x1
        )  # nothing looks larger than it is


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    law = law_of(a)
    say(too_soft(a, law))
    say(angles_in_radians([law]))
    check_start(a, law)
    folder = open_results(a)
    test = mpm.ElementTest(law, [-a.pressure] * 3 + [0.0] * 3)
    columns = COLUMNS + (OF_CYCLES if a.test in CYCLIC else [])
    with History(folder / "history.csv", columns) as history:
        stopped = run(test, a, history)
    end = {name: float(history[name][-1]) for name in columns}
    end |= milestones(history, a) if a.test in CYCLIC else {}
    of_oedometer = stiffness(history) if a.test == "oedometer" else {}
    summary = {
        "finished_run": stopped is None,
        "stopped_because": stopped,
        "steps": len(history) - 1,
        **end,
        **of_oedometer,
    }
    if stopped is None and not too_soft(a, law):
        say(not_yielded(a, end["plastic_strain"]))
        say(never_cycled(a, end.get("cycles", 0.0)))
    pictures = {"stress_path": lambda: draw(history, a, folder / "stress_path.png")}
    largest = history["q_Pa"].max()
    said = f"{a.test}: p' {end['p_Pa'] / 1e3:.4g} kPa, q {end['q_Pa'] / 1e3:.4g} kPa, largest q {largest / 1e3:.4g} kPa"
    if "shear" in a.test:
        said += f", largest shear stress {np.abs(history['shear_stress_Pa']).max() / 1e3:.4g} kPa"
    if of_oedometer.get("tangent_oedometer_modulus_Pa") is not None:
        said += (
            f"; axial stress {end['axial_stress_Pa'] / 1e3:.4g} kPa, lateral {end['lateral_stress_Pa'] / 1e3:.4g} kPa, tangent modulus "
            f"{of_oedometer['tangent_oedometer_modulus_Pa'] / 1e6:.4g} MPa"
        )
    return write_summary(folder, a, summary, pictures=pictures, said=said)


if __name__ == "__main__":
    run_study(main)
