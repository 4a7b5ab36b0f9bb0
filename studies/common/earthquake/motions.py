"""Synthetic motions of the ground."""

from __future__ import annotations

import numpy as np

import mpm_core as mpm

STEP = 0.01
"""Time step of synthetic motions [s]"""


def ricker(frequency: float, peak: float, duration: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Ricker's wavelet as acceleration, with its peak after 1.5 periods.

    Args:
        frequency: of the largest spectral amplitude [Hz].
        peak: acceleration [m/s2].
        duration: [s]; step: [s].

    Returns:
        Times (n) [s] and accelerations (n) [m/s2].
    """
    time = np.linspace(0.0, duration, round(duration / step) + 1)
    phase = (np.pi * frequency * (time - 1.5 / frequency)) ** 2
    return time, peak * (1 - 2 * phase) * np.exp(-phase)


def band_limited_noise(
    band: tuple[float, float], peak: float, duration: float, step: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Noise of random phase and flat spectrum in a band, whose envelope rises and falls as a strong motion does.

    The envelope is that of Saragoni & Hart (1974, Simulation of artificial earthquakes, Earthq. Eng. Struct. Dyn. 2) with its
    maximum at a fifth of the duration; phases come from NumPy's PCG64 generator, so that a seed gives one motion anywhere.

    Args:
        band: lowest and highest frequency [Hz].
        peak: largest acceleration [m/s2].
        duration: [s]; step: [s].
        seed: of the phases.

    Returns:
        Times (n) [s] and accelerations (n) [m/s2]; the velocity ends at zero but for the trend that a baseline correction takes.
    """
    n = round(duration / step) + 1
    time = step * np.arange(n)
    frequency, inside = noise_band(band, duration, step)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(frequency))
    noise = np.fft.irfft(inside * np.exp(1j * phase), 2 * n)[:n]
    part = time / (0.2 * duration)
    acceleration = noise * (part * np.exp(1 - part)) ** 2
    return time, acceleration * peak / np.abs(acceleration).max()


def noise_band(band: tuple[float, float], duration: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (k) [Hz] of the Fourier series of `band_limited_noise`, and whether each is in the band."""
    n = round(duration / step) + 1
    frequency = np.fft.rfftfreq(2 * n, step)  # twice the length, since the ends of a Fourier series meet
    return frequency, (frequency >= band[0]) & (frequency <= band[1])


def as_motion(time: np.ndarray, acceleration: np.ndarray) -> mpm.Motion:
    """The motion of an acceleration after a linear baseline correction, brought to rest over its last tenth.

    An acceleration that ends at rest by itself, as a Ricker wavelet does, stays as it is.
    """
    plain = mpm.motion_of_acceleration(time, acceleration, baseline=None)
    if abs(plain.velocity[-1]) < 1e-6 * np.abs(plain.velocity).max():
        return plain
    motion = mpm.motion_of_acceleration(time, acceleration, baseline=1)
    span = time[-1] - time[0]
    fade = np.clip((time[-1] - time) / (0.1 * span), 0.0, 1.0)
    return mpm.Motion(time, motion.velocity * 0.5 * (1 - np.cos(np.pi * fade)))


def accelerations(time: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the intervals between times [s], and the acceleration in each of them [m/s2], (n - 1) each.

    The velocity of a motion is linear between its samples, so that its acceleration is constant there. A gradient at the samples
    would be the mean over two intervals, which lowers peaks: by 10 % at 5 Hz with steps of 0.02 s.
    """
    return 0.5 * (time[1:] + time[:-1]), np.diff(velocity) / np.diff(time)
