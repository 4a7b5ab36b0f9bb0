"""Lengths as studies print them."""

LEAST = 1e-9
"""Length [m] below which there is only round-off"""


def metres(length: float) -> str:
    """A length [m] to the millimetre, and with three significant digits where that is not enough."""
    if abs(length) < LEAST:
        return "0 m"
    return f"{length:.3f} m" if abs(length) >= 0.1 else f"{length:.3g} m"
