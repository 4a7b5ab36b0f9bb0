"""What the tests of SANISAND share: Toyoura sand, elements of it, and its equations integrated independently."""

import numpy as np
from scipy.integrate import solve_ivp

import mpm_core as mpm

TOYOURA = {
    "rigidity": 125.0, "poisson": 0.05, "critical_slope": 1.25, "extension_ratio": 0.712, "critical_void_ratio": 0.934,
    "critical_compression": 0.019, "critical_exponent": 0.7, "hardening": 7.05, "hardening_void_ratio": 0.968,
    "bounding_exponent": 1.1, "dilatancy": 0.704, "dilatancy_exponent": 3.5, "fabric_limit": 4.0, "fabric_rate": 600.0,
}  # fmt: skip
"""Dafalias & Manzari (2004), table 1"""
P_AT = 101.325e3
M, C = TOYOURA["critical_slope"], TOYOURA["extension_ratio"]


def sand(void_ratio=0.8, **changes):
    return mpm.Sanisand(**{**TOYOURA, "void_ratio": void_ratio, "largest_pressure": 1e6, **changes})


def element(law, pressure, components=6):
    return mpm.ElementTest(law, [-pressure] * 3 + [0.0] * (components - 3))


def critical_void_ratio(p):
    return 0.934 - 0.019 * (p / P_AT) ** 0.7


def critical_pressure(void_ratio):
    return P_AT * ((0.934 - void_ratio) / 0.019) ** (1 / 0.7)


def tensor(components):
    xx, yy, zz, xy, yz, xz = components
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class Reference:
    """The equations of the paper for one point, in its signs (compression positive) and in full tensors.

    They are integrated by an ordinary differential equation solver, with elastic parts up to the yield surface by events.
    """

    def __init__(self, law, pressure):
        self.law, self.void_ratio = law, law.void_ratio
        self.stress, self.alpha, self.z = pressure * np.eye(3), np.zeros((3, 3)), np.zeros((3, 3))
        self.reversal = np.zeros((3, 3))

    def moduli(self, p, e):
        law = self.law
        shear = law.rigidity * P_AT * (2.97 - e) ** 2 / (1 + e) * np.sqrt(p / P_AT)
        return shear, 2 * (1 + law.poisson) / (3 * (1 - 2 * law.poisson)) * shear

    def direction(self, stress, alpha):
        p = np.trace(stress) / 3
        ratio = (stress - p * np.eye(3)) / p
        length = np.linalg.norm(ratio - alpha)
        return p, ratio, (ratio - alpha) / max(length, 1e-300), length - np.sqrt(2 / 3) * self.law.yield_size

    def rates(self, stress, alpha, z, e, strain_rate):
        """Rates of stress, alpha and z, and the loading index."""
        law, unit = self.law, np.eye(3)
        p, ratio, n, _ = self.direction(stress, alpha)
        shear, bulk = self.moduli(p, e)
        volume = np.trace(strain_rate)
        deviator = strain_rate - volume / 3 * unit
        cosine = np.sqrt(6) * np.trace(n @ n @ n)
        c = law.extension_ratio
        g = 2 * c / ((1 + c) - (1 - c) * cosine)
        psi = e - critical_void_ratio(p)
        bound = np.sqrt(2 / 3) * (g * law.critical_slope * np.exp(-law.bounding_exponent * psi) - law.yield_size) * n
        dilatancy = (
            np.sqrt(2 / 3) * (g * law.critical_slope * np.exp(law.dilatancy_exponent * psi) - law.yield_size) * n
        )
        b0 = law.rigidity * law.hardening * (1 - law.hardening_void_ratio * e) / np.sqrt(p / P_AT)
        h = b0 / max(np.sum((alpha - self.reversal) * n), 1e-12)
        modulus = 2 / 3 * p * h * np.sum((bound - alpha) * n)
        d = law.dilatancy * (1 + max(np.sum(z * n), 0)) * np.sum((dilatancy - alpha) * n)
        b, across = 1 + 1.5 * (1 - c) / c * g * cosine, 3 * np.sqrt(1.5) * (1 - c) / c * g
        flow = b * n - across * (n @ n - unit / 3)
        along = np.sum(n * ratio)
        index = (2 * shear * np.sum(n * deviator) - along * bulk * volume) / (
            modulus + 2 * shear * (b - across * np.trace(n @ n @ n)) - bulk * d * along
        )
        index = max(index, 0.0)
        stress_rate = 2 * shear * (deviator - index * flow) + bulk * (volume - index * d) * unit
        z_rate = -law.fabric_rate * max(-index * d, 0.0) * (law.fabric_limit * n + z)
        return stress_rate, index * 2 / 3 * h * (bound - alpha), z_rate, index

    def strained(self, strain):
        """Take an increment, components positive in tension with engineering shear as the law's."""
        increment = -tensor(np.asarray(strain) * [1, 1, 1, 0.5, 0.5, 0.5])
        volume = np.trace(increment)
        start = 1 + self.void_ratio

        def void_ratio(t):
            return start * np.exp(-t * volume) - 1

        def elastic(t, y):
            stress = y.reshape(3, 3)
            shear, bulk = self.moduli(np.trace(stress) / 3, void_ratio(t))
            return (2 * shear * (increment - volume / 3 * np.eye(3)) + bulk * volume * np.eye(3)).ravel()

        def on_surface(t, y):
            return self.direction(y.reshape(3, 3), self.alpha)[3] - 1e-11

        on_surface.terminal, on_surface.direction = True, 1
        options = {"rtol": 1e-10, "atol": 1e-12, "method": "RK45"}
        begun, far = 0.0, self.direction(self.stress, self.alpha)[3]
        index = self.rates(self.stress, self.alpha, self.z, self.void_ratio, increment)[3] if far > -1e-6 else 0.0
        if not index > 0:
            part = solve_ivp(elastic, (0, 1), self.stress.ravel(), events=on_surface, **options)
            self.stress, begun = part.y[:, -1].reshape(3, 3), part.t[-1]
        if begun < 1:
            _, _, n, _ = self.direction(self.stress, self.alpha)
            if np.sum((self.alpha - self.reversal) * n) < 0:
                self.reversal = self.alpha.copy()

            def plastic(t, y):
                parts = y.reshape(3, 3, 3)
                return np.array(self.rates(*parts, void_ratio(t), increment)[:3]).ravel()

            whole = solve_ivp(plastic, (begun, 1), np.array([self.stress, self.alpha, self.z]).ravel(), **options)
            self.stress, self.alpha, self.z = whole.y[:, -1].reshape(3, 3, 3)
        self.void_ratio = void_ratio(1)
