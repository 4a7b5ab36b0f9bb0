"""Options of the motion of rock that studies of earthquakes have in common."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..checks import check_effect, check_file
from ..options import add_choice, add_count, add_number, check
from .motions import STEP, noise_band

HIGHEST = 1 / (4 * STEP)
"""Highest frequency in spectra of histories, whose steps are twice those of the motion [Hz]"""


def add_motion_options(p: ArgumentParser) -> None:
    """The rock below, the motion of its outcrop, and the damping of the soil at small strains."""
    add_number(p, "--rock-density", 2400.0, "kg/m3", "density of the rock below", above=0)
    add_number(p, "--rock-speed", 1000.0, "m/s", "speed of shear waves in the rock", above=0)
    add_choice(p, "--motion", "noise", ("noise", "ricker"), "synthetic motion of the outcrop")
    p.add_argument("--accelerogram", type=Path, default=None, metavar="FILE",
                   help="file of the outcrop's motion in place of a synthetic one: times [s] and accelerations, or .AT2 of PEER")  # fmt: skip
    add_choice(
        p,
        "--unit",
        None,
        ("m/s2", "cm/s2", "g"),
        "unit of the accelerations in that file (default: that of a PEER file, else m/s2)",
    )
    add_number(p, "--peak", 4.0, "m/s2", "largest acceleration of a synthetic motion", above=0)
    add_number(
        p,
        "--frequency",
        2.0,
        "Hz",
        "frequency of the Ricker wavelet, or twice the lowest one of the noise",
        above=0,
    )
    add_number(p, "--highest-frequency", 6.0, "Hz", "highest frequency of the noise", above=0)
    add_number(p, "--duration", 8.0, "s", "duration of a synthetic motion", above=0)
    add_count(p, "--seed", 1, "seed of the random numbers of the noise")
    add_number(p, "--rest", 3.0, "s", "time that is computed after the motion", at_least=0)
    add_number(p, "--damping-ratio", 0.02, "-", "damping ratio of the soil at small strains", at_least=0, below=0.5)


def check_motion(p: ArgumentParser, a: Namespace) -> None:
    """End with an error where the options of the motion do not fit together."""
    check_file(p, a.accelerogram, "--accelerogram")
    synthetic = a.accelerogram is None
    check_effect(p, a, not synthetic, ("--unit",), "--accelerogram")
    check_effect(p, a, synthetic, ("--motion", "--peak", "--duration", "--seed"), "no --accelerogram")
    check_effect(p, a, a.motion == "noise", ("--highest-frequency", "--seed"), "--motion noise")
    band = 0.5 * a.frequency, a.highest_frequency
    check(p, a.motion != "noise" or band[0] < band[1],
          lambda: f"--highest-frequency is {band[1]:g} Hz, expected above the lowest frequency of the noise (half of "
                  f"--frequency, {band[0]:g} Hz)")  # fmt: skip
    name, most = ("--highest-frequency", HIGHEST) if a.motion == "noise" else ("--frequency", HIGHEST / 2)
    value = a.highest_frequency if a.motion == "noise" else a.frequency
    check(p, value <= most,
          lambda: f"{name} is {value:g} Hz, expected at most {most:g} Hz: steps of {2 * STEP:g} s have spectra up to {HIGHEST:g} Hz"
                  + ", and a Ricker wavelet has energy up to twice its frequency" * (a.motion == "ricker"))  # fmt: skip
    check(p, a.motion != "ricker" or a.duration >= 3 / a.frequency,
          lambda: f"--duration is {a.duration:g} s, expected at least {3 / a.frequency:g} s, three periods of --frequency, which a "
                  "Ricker wavelet takes")  # fmt: skip
    check(p, a.motion != "noise" or not synthetic or noise_band(band, a.duration, STEP)[1].any(),
          lambda: f"--duration is {a.duration:g} s, in which noise of steps of {STEP:g} s has no frequency from {band[0]:g} to "
                  f"{band[1]:g} Hz; expected a longer one, or other values of --frequency and --highest-frequency")  # fmt: skip
