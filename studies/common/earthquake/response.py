"""Level ground under shear waves in closed form, and spectra of motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mpm_core as mpm

UNDAMPED = mpm.Rayleigh()

LEAST_ENERGY = 1e-4
"""Fraction of the largest energy in a spectrum below which a ratio to it says nothing: a hundredth of the amplitude"""


def amplification(
    frequency: np.ndarray,
    layers: Sequence[tuple[float, float, float]],
    rock_impedance: float,
    rayleigh: mpm.Rayleigh = UNDAMPED,
) -> np.ndarray:
    """Motion of the surface of layers over that of an outcrop of the half-space below them, complex (n).

    Waves that go up and down in each layer, from the surface, where they are equal, to the half-space (Kramer 1996, Geotechnical
    Earthquake Engineering, section 7.2.1.4). The damping is Rayleigh's: G (1 + i w beta) and rho (1 - i alpha / w).

    Args:
        frequency: above 0 (n) [Hz].
        layers: thickness [m], shear modulus [Pa] and density [kg/m3] of each, from the surface down.
        rock_impedance: density times speed of shear waves of the half-space [kg/(m2 s)].
        rayleigh: damping of the layers.
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    up = down = np.ones_like(omega, dtype=complex)
    above = None
    for thickness, modulus, density in layers:
        complex_modulus = modulus * (1 + 1j * omega * rayleigh.stiffness)
        complex_density = density * (1 - 1j * rayleigh.mass / omega)
        impedance = np.sqrt(complex_modulus * complex_density)
        if above is not None:
            up, down = _below(up, down, above / impedance)
        phase = 1j * omega * np.sqrt(complex_density / complex_modulus) * thickness
        up, down, above = up * np.exp(phase), down * np.exp(-phase), impedance
    up, _ = _below(up, down, above / rock_impedance)
    return 1 / up


def _below(up: np.ndarray, down: np.ndarray, ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Waves below a border, by the ratio of the impedance above it to that below."""
    return 0.5 * (up * (1 + ratio) + down * (1 - ratio)), 0.5 * (up * (1 - ratio) + down * (1 + ratio))


def spectral_ratio(
    time: np.ndarray, moved: np.ndarray, reference: np.ndarray, band: tuple[float, float], smoothing: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Ratio of the Fourier amplitudes of two motions that begin and end at rest.

    Args:
        time: evenly spaced (n) [s].
        moved, reference: motions (n), in one unit.
        band: of frequencies [Hz].
        smoothing: width of the windows over which the energies of both are summed first [Hz]; 0 for none.

    Returns:
        Frequencies in the band (k) [Hz] and the ratio there (k); NaN where the reference has next to no energy, so that what is
        not linear in the other motion, or its end, would be taken for an amplification.
    """
    step = (time[-1] - time[0]) / (len(time) - 1)
    frequency = np.fft.rfftfreq(4 * len(time), step)
    energies = [np.abs(np.fft.rfft(motion, 4 * len(time))) ** 2 for motion in (moved, reference)]
    width = max(1, round(smoothing / frequency[1]))
    energies = [np.convolve(energy, np.ones(width) / width, mode="same") for energy in energies]
    inside = (frequency >= band[0]) & (frequency <= band[1])
    moves = np.where(energies[1] > LEAST_ENERGY * energies[1].max(), energies[1], np.nan)
    return frequency[inside], np.sqrt(energies[0][inside] / moves[inside])
