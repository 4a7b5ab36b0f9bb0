"""Between finite elements and particles: hand-over, comparison, stages of particles."""
