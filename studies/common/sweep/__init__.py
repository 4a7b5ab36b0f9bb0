"""Sweeps over the parameters of a study."""
