"""Transfer between finite elements and particles: hand-over, comparison, stages of particles."""
