"""Run-out over terrain."""
