"""Ground reaction curve of a circular tunnel in Mohr-Coulomb ground under a hydrostatic stress, elastic and perfectly plastic.

Salençon (1969, Int. J. Rock Mech. Min. Sci. 6, 231-236); Carranza-Torres (2003, ibid. 40, 629-639). The ground ends at a rigid circle, far away in
most uses. Compression is positive here, and the stress along the tunnel is the intermediate one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

FURTHEST = 1e3
"""Radii of the tunnel within which ground without an end yields"""


@dataclass(frozen=True)
class Ground:
    """The tunnel and its ground.

    radius: of the tunnel [m]; outer: of the rigid circle [m], infinite for none; pressure: stress before the tunnel [Pa]; angles in degrees
    """

    radius: float
    outer: float
    pressure: float
    young: float
    poisson: float
    cohesion: float
    friction_angle: float
    dilation_angle: float

    @property
    def shear(self) -> float:
        """Shear modulus [Pa]."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def strength(self) -> tuple[float, float]:
        """N and the uniaxial compressive strength [Pa]: the ground yields where s1 = N s3 + strength."""
        sine, cosine = np.sin(np.radians(self.friction_angle)), np.cos(np.radians(self.friction_angle))
        return (1 + sine) / (1 - sine), 2 * self.cohesion * cosine / (1 - sine)

    def outside(self, inner: float, stress: float) -> float:
        """Inward displacement [m] of elastic ground outside of a circle under the radial stress there [Pa]."""
        b = (self.pressure - stress) / (1 / inner**2 + self._constant())
        return inner * b * (1 / inner**2 - (1 - 2 * self.poisson) * self._constant()) / (2 * self.shear)

    def _constant(self) -> float:
        """The changes of the radial and hoop stress are -B (1 / r^2 + this) and B (1 / r^2 - this), with no displacement at the end."""
        return 1 / ((1 - 2 * self.poisson) * self.outer**2)

    def yielding(self, inner: float) -> float:
        """Radial stress [Pa] at which elastic ground outside of a circle begins to yield."""
        n, strength = self.strength
        b = ((n - 1) * self.pressure + strength) / ((n + 1) / inner**2 + (n - 1) * self._constant())
        return self.pressure - b * (1 / inner**2 + self._constant())

    def plastic_radius(self, support: float) -> float:
        """Radius [m] up to which the ground yields, under a pressure on the wall of the tunnel [Pa]."""
        n, strength = self.strength
        attraction = strength / (n - 1)

        def beyond(r: float) -> float:
            return (support + attraction) * (r / self.radius) ** (n - 1) - attraction - self.yielding(r)

        furthest = min(self.outer, FURTHEST * self.radius)
        return self.radius if beyond(self.radius) >= 0 else brentq(beyond, self.radius, furthest, xtol=1e-12)

    def wall(self, support: float) -> float:
        """Inward displacement of the wall [m] under a pressure on it [Pa]."""
        edge = self.plastic_radius(support)
        if edge == self.radius:
            return self.outside(edge, support)
        # Plastic ground: s_r + H = A r^(N-1), s_t + H = N A r^(N-1) with H the attraction; du/dr + K u/r is that of the elastic strains.
        n, strength = self.strength
        dilation = np.sin(np.radians(self.dilation_angle))
        k, nu, attraction = (1 + dilation) / (1 - dilation), self.poisson, strength / (n - 1)
        a = (support + attraction) / self.radius ** (n - 1)

        def elastic(radial: float, hoop: float) -> float:
            return ((1 - nu - k * nu) * radial + (k * (1 - nu) - nu) * hoop) / (2 * self.shear)

        even, rising = elastic(-attraction - self.pressure, -attraction - self.pressure), elastic(a, n * a)

        def particular(r: float) -> float:
            return even * r / (1 + k) + rising * r**n / (n + k)

        at_edge = self.outside(edge, self.yielding(edge))
        return particular(self.radius) + (at_edge - particular(edge)) * (edge / self.radius) ** k

    def lined(self, released: float, stiffness: float) -> float:
        """Pressure on a lining [Pa] that comes when a fraction of the stress before the tunnel is released.

        stiffness: pressure by which the lining gets smaller by 1 m, its axial stiffness over the square of its radius [Pa/m]
        """
        at_lining = self.wall((1 - released) * self.pressure)

        def unbalanced(pressure: float) -> float:
            return stiffness * (self.wall(pressure) - at_lining) - pressure

        return brentq(unbalanced, 0.0, (1 - released) * self.pressure, xtol=1e-6)

    def intermediate(self, support: float) -> bool:
        """Whether the stress along the tunnel, which begins as the others, is the intermediate one at the wall."""
        n, strength = self.strength
        hoop = n * support + strength
        along = self.pressure + self.poisson * (support + hoop - 2 * self.pressure)
        return self.plastic_radius(support) == self.radius or support <= along <= hoop
