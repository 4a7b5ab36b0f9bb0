"""Finite elements: forms, loads, supports, equilibrium, stages, collapse and strength reduction."""
