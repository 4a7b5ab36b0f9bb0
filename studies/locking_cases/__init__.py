"""The bodies of the study locking: each has its mesh, its reference by Taylor-Hood elements, and its particles."""

from . import cook, footing, slope

CASES = {case.NAME: case for case in (cook, footing, slope)}
