"""Reports of a run: time, energies and other sums over the model."""

from __future__ import annotations

from dataclasses import dataclass

from .checks import renamed
from .views import report_text


@dataclass(frozen=True, repr=False)
class Report:
    """State of a run at one time; sums are over all ranks. Energies in J, in plane strain per metre of thickness."""

    def __repr__(self) -> str:
        return report_text(self)

    time: float
    """Time [s]"""
    steps: int
    """Steps since the model was made"""
    dt: float
    """Length of the last step [s]"""
    particles: int
    mass: float
    """[kg]"""
    momentum: tuple[float, ...]
    """[kg m/s]"""
    kinetic_energy: float
    """Kinetic energy of the particles, with affine transfer that of the gradients of their velocities included (docs/energy.md)"""
    external_work: float
    """Work of gravity, tractions, contact forces and of pressures where pore water enters, since the model was made"""
    internal_work: float
    """Work of the nodal forces of the stresses"""
    damping_work: float
    """Energy taken out by local and by Rayleigh damping"""
    support_work: float
    """Work of prescribed velocities"""
    drag_work: float
    """Energy taken out by pore water that flows through the soil"""
    friction_work: float
    """Energy taken out by contact between velocity fields: friction, and impacts"""
    stress_work: float
    """Work of the particles' stresses on their strains and on their water: stored energy and plastic dissipation"""
    stored_energy: float
    """Energy of the present elastic strains; NaN with a law that does not define it (Python, UMAT)"""
    plastic_work: float
    """`stress_work` less what has been stored, since the particles were last changed by anything but a step"""
    pic_loss: float
    """Kinetic energy taken out by PIC or affine transfer; a negative one, put in, counts as unexplained too"""
    nodal_kinetic_energy: float
    """Kinetic energy of the nodes in the last step; lower than that of the particles by their motion relative to the nodes, and
    with affine transfer by the inertia of short waves"""
    unexplained_energy: float
    """External and support work, less damping, drag and friction work, PIC loss, stress work and the gain of kinetic energy: what
    the discretisation generates (negative) or dissipates (positive), since the particles were last changed by anything but a step
    with inertia or flow"""
    energy_scale: float
    """Largest of external and support work and stress work so far over the same time, stored energy, and kinetic energy at the
    start and now"""
    plastic_fraction: float
    """Fraction of the particles that yielded in the last step"""
    resting_cells: int
    """Cells that rest; each counts as one of the particles above"""
    converted_cells: int
    """Resting cells that have turned into particles since the model was made"""
    unbalanced_ratio: float
    """Out-of-balance over external force, Euclidean norms over the nodes; over reactions where there is no external force"""
    outflow_particles: int
    """Particles that left through outflow facets"""
    outflow_mass: float
    particle_steps: int
    """Sum over steps of the number of particles"""

    @property
    def unexplained_fraction(self) -> float:
        """`unexplained_energy` over `energy_scale`; 0 where nothing has moved."""
        return self.unexplained_energy / self.energy_scale if self.energy_scale > 0 else 0.0

    plastic_share = renamed("plastic_share", "plastic_fraction")
    unexplained_share = renamed("unexplained_share", "unexplained_fraction")

    def is_quasi_static(self, tolerance: float = 1e-3) -> bool:
        """Whether the soil is at rest: the out-of-balance ratio and kinetic energy over external work are not above a tolerance.

        Kinetic energy is not considered if external forces have done no work.
        """
        work = abs(self.external_work)
        return self.unbalanced_ratio <= tolerance and (work == 0 or self.kinetic_energy <= tolerance * work)


@dataclass(frozen=True, repr=False)
class ImplicitReport(Report):
    """State of an implicit run; the last three attributes refer to the steps since the last report."""

    iterations: int
    """Iterations of the solver, including those of failed steps"""
    cuts: int
    """Cutbacks: steps that did not converge and were repeated with half their length"""
    residual: float
    """|r| relative to the largest of |f_ext|, |f_int| and inertia, when the last step was solved"""
