"""A model: background mesh, particles, laws, loads and supports; and the schemes that move it."""

import os
from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import ArrayLike

from . import checkpoint
from ._core import InputError, Integration, StressUpdate, Transfer
from .absorbing import refuse_absorbing
from .body import Body
from .checks import count, flag, of_kind, positive, watcher
from .collective import collectively
from .contact import refuse_contacts, refuse_drag, refuse_driven_bodies, require_new_soil_outside
from .contact_methods import ContactMethods
from .energy import energy_limit as checked_energy_limit
from .equilibrium import find_equilibrium, refuse_beyond_equilibrium
from .explicit import (
    explicit_options,
    report_times,
    require_particles,
    run_explicit,
    run_options,
    steps_between,
    warn_of_parts,
)
from .far_field import refuse_far_field
from .ghost import GhostPenalty
from .implicit import checked_accuracy, implicit_options, run_implicit
from .integration import integration_of
from .member_methods import MemberMethods, refuse_members
from .mesh import floats
from .newton import Newton
from .partition import rebalance_threshold
from .pore_water import refuse_water
from .rayleigh import Rayleigh, checked_rayleigh
from .relaxation import Relaxation
from .report import ImplicitReport, Report
from .reports import Reports
from .resting import Conversion, checked_conversion
from .setup_warnings import warn_of_setup
from .two_phase import begin_two_phases, refuse_two_phases
from .views import model_text

CONVERSION = Conversion()
"""When resting cells turn into particles, unless a run is given other criteria"""


class Model(ContactMethods, MemberMethods, Body):
    """Soil as particles on a background mesh.

    Args:
        mesh: the background mesh.
        laws: one constitutive law, or a list of laws; particles refer to them by number.
        geometry: what the mesh stands for: plane strain by default in two dimensions, `Geometry.AXISYMMETRIC` on
            request. In axial symmetry x is the radius; nodes on the axis x = 0 have no radial velocity; masses, forces and
            energies are per radian.
        velocity_fields: number of the velocity field of each law, from 0 without gaps; by default all particles move
            with one. Bodies in different fields of one mesh do not interact unless `add_field_contact` says how. With several
            fields, only explicit runs are possible.

    Raises:
        InputError: no law, or something that is none; a geometry that the mesh cannot have, a node at a negative
            radius; numbers of velocity fields with gaps, or not one for each law.

    Note:
        Collective, as all methods are unless they say otherwise.
    """

    def __repr__(self) -> str:
        return model_text(self)

    # --- checkpoints ---------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str], notes: Mapping[str, Any] | None = None) -> None:
        """Save the complete state: particles, loads, supports, time and totals.

        The file is written as ``path.part``, flushed to the disk and renamed, so that a file with the name ``path`` is always
        complete, even if the run is killed.

        Args:
            path: of the file, commonly ``NAME.h5``; the folder must exist.
            notes: data that JSON can represent, for instance the options of the run; `checkpoint_description` returns them.

        Raises:
            InputError: notes that JSON cannot hold.
            RunError: on all ranks, with path and reason, when it cannot be written; an older file stays as it is.
        """
        checkpoint.save(self, path, notes)

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Restore the state that ``save`` wrote; particles, loads and supports of the model are replaced.

        Its surfaces are those of the run; fields of others that the model has get their initial value.
        On the same number of ranks (and partition) the run continues as if it had not been interrupted, to the last bit; on
        another one it differs by the order of sums.

        Args:
            path: of the file. It must have been saved by a model with the same mesh and laws.

        Raises:
            InputError: a file of another mesh, of other laws or of another dimension.
            RunError: on all ranks, with path and reason: the file is not there, not a checkpoint, truncated, damaged or of an
                unknown format. The model does not change then.
        """
        checkpoint.restore(self, path)

    @property
    def resumed_dt(self) -> float | None:
        """Largest time step [s] of the implicit run that saved the restored checkpoint; None if there was no implicit run."""
        return None if self._resumed is None else self._resumed.longest

    # --- runs ----------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._core.time

    @property
    def steps(self) -> int:
        """Steps since the model was made."""
        return self._core.steps

    def critical_time_step(self) -> float:
        """Critical time step (16): smallest h_min / c_d over the particles [s], less with structural members; see `critical_cell`."""
        return self._core.critical_time_step()

    def out_of_balance(
        self,
        gravity: ArrayLike | None = None,
        *,
        nmd: bool = False,
        integration: Integration | None = None,
    ) -> float:
        """Out-of-balance ratio |f_ext - f_int| / |f_ext| of the present state, over the nodes [-].

        Args:
            gravity: [m/s2], shape (D,), to weigh the particles with; by default the model's own, without its ramp.
            nmd: take forces of averaged mean stresses, as explicit steps with ``nmd`` do.
            integration: how stresses become forces in the steps that are meant; by default as in ``explicit``.
        """
        g = self._core.gravity if gravity is None else floats("gravity", gravity, (self.mesh.dim,)).tolist()
        return self._core.out_of_balance(g, integration_of(self, integration), flag("nmd", nmd))

    def report(self) -> Report:
        """State of the run at the present time."""
        values = self._core.diagnostics()
        values["momentum"] = tuple(values["momentum"][: self.mesh.dim])
        values["particle_steps"] = int(values["particle_steps"])
        return Report(time=self.time, steps=self._core.steps, dt=self._core.last_dt, **values)

    def nodal(self, name: str, velocity_field: int = 0) -> Any:
        """A copy of a nodal field of the last step, a row for each of ``mesh.points``; InputError before the first one.

        It is "velocity" [m/s], "acceleration" [m/s2], "internal_force" [N], shape (nodes, D), or "mass" [kg], (nodes,).
        """
        return self._core.nodal(name, velocity_field)

    def explicit(
        self,
        until: float,
        *,
        every: float | None = None,
        every_steps: int | None = None,
        since: float | None = None,
        watch: Callable[[], bool] | None = None,
        dt: float | None = None,
        courant: float = 0.5,
        damping: float = 0.0,
        rayleigh: Rayleigh | None = None,
        pic: float = 0.0,
        nmd: bool = False,
        integration: Integration | None = None,
        stress_update: StressUpdate = StressUpdate.MODIFIED_LAST,
        transfer: Transfer = Transfer.FLIP,
        moving_cells: bool = False,
        allow_unstable: bool = False,
        rebalance: float | None = None,
        energy_limit: float | None = 0.2,
        conversion: Conversion | None = CONVERSION,
        reproducible: bool = False,
    ) -> Reports[Report]:
        """Run the explicit scheme (16)-(20) of the paper; yields reports at the given intervals and at the end.

        Args:
            until: time to reach [s].
            every: time between reports [s]; by default only at the end.
            every_steps: steps between reports, counted since the model was made.
            since: time from which ``every`` counts [s]; by default the present. After a restart, give the start of the first
                run, so that reports are at the same times to the last bit.
            watch: function that is called after every 32nd step and before each report, on all ranks alike; it may save the
                model. When it returns true (on all ranks), the run ends with a report.
            dt: time step [s]; by default ``courant`` times the critical one, which is updated as the soil changes.
            courant: alpha_c of (17), in (0, 1].
            damping: local damping alpha, in [0, 1); it must be 0 with free fields beside the sides, and damps the waves of an
                earthquake, for which ``rayleigh`` is meant.
            rayleigh: damping of soil at small strains; see `Rayleigh`.
            pic: PIC fraction: the part of the particles' own velocities that the nodal velocities replace in a critical time
                step, in [0, 1]; 0 is FLIP. A step of dt takes 1 - (1 - pic)^(dt / dt_cr), so that the effect does not depend on
                the step.
            nmd: average volumetric strains over nodes (nodal mixed discretisation), and mean stresses for the nodal forces by the
                transpose, so that both do the same work.
            integration: how stresses become forces: PARTICLES, MIXED or DUAL_DOMAIN; see `Integration`. By default as
                `default_integration` says: MIXED in soil with cohesion and six or more particles in a cell, otherwise PARTICLES.
            stress_update: when stresses are updated: MODIFIED_LAST (MUSL), LAST (USL) or FIRST (USF).
            transfer: which velocities particles carry: FLIP or AFFINE; see `Transfer`.
            moving_cells: let the cells that hold particles move with them, so that no particle leaves its cell (total Lagrangian
                MPM). For elastic bodies that bend or stretch, which need many particles in a cell otherwise. The body keeps the
                boundary conditions of the nodes of its cells, and does not feel others, nor parts of itself that touch: the run
                ends with an error before it meets the boundary of the mesh, or when a cell is too distorted. Any other run begins
                with the mesh as it was. With FLIP and MODIFIED_LAST only, without water, contact, resting cells, outflow facets
                and absorbing sides.
            allow_unstable: take ``dt`` even above the critical time step.
            rebalance: load imbalance (maximum over mean number of particles per rank), above 1, at which the mesh is
                repartitioned (see the method ``rebalance``); checked every 32 steps. By default the partition does not change.
            energy_limit: `Report.unexplained_energy` over the largest `Report.energy_scale` of the run so far, at which the run
                ends with an error; None for no limit. Above 0.01 there is an `EnergyWarning`.
            conversion: when resting cells turn into particles (see ``rest``); None if only those do that a particle enters.
            reproducible: compute the same particles to the last bit on any number of ranks, from the same start and by the same
                program on the same kind of processor; sums in reports differ by round-off.

        Raises:
            InputError: an argument out of its range; ``reproducible``, ``transfer`` or ``moving_cells`` with what it does not
                cover; ``dt`` above the critical time step, with both numbers.
            RunError: a particle left the mesh, a value is not finite, or a law failed, with the position; the unexplained
                energy reached its limit; or ``moving_cells`` cannot go on, with the reason, after a whole step.
        """
        refuse_far_field(self, "the explicit scheme")
        damped = collectively(self.comm, lambda: checked_rayleigh(rayleigh))
        if moving_cells and rebalance is not None:
            raise InputError(
                f"rebalance is {rebalance} with moving_cells, expected None: particles do not change their ranks then"
            )
        self._check_free_fields(damping, damped)
        integration = integration_of(self, integration)
        options, run, times, threshold, steps, limit, _ = collectively(
            self.comm,
            lambda: (
                explicit_options(
                    damping, nmd, integration, stress_update, damped, reproducible, transfer, moving_cells
                ),
                run_options(dt, courant, pic, allow_unstable),
                report_times(self, until, every, since),
                rebalance_threshold(rebalance),
                steps_between(every_steps),
                checked_energy_limit(energy_limit),
                watcher(watch),
            ),
        )
        begin_two_phases(self, integration, stress_update, damped)
        run.conversion = checked_conversion(self, conversion, integration)
        require_particles(self)
        require_new_soil_outside(self)
        warn_of_setup(self, nmd, damping)
        if moving_cells:
            warn_of_parts(self)
        reports = run_explicit(self, options, run, times, watch, threshold, steps, limit, damped)
        return Reports(reports, "explicit", self, until)

    def implicit(
        self,
        until: float,
        *,
        dt: float,
        solver: Newton | Relaxation | None = None,
        every: float | None = None,
        every_steps: int | None = None,
        since: float | None = None,
        watch: Callable[[], bool] | None = None,
        quasi_static: bool = False,
        damping: float = 0.0,
        rayleigh: Rayleigh | None = None,
        pic: float = 0.0,
        nmd: bool = False,
        integration: Integration | None = None,
        ghost: GhostPenalty | None = None,
        small_displacements: bool = False,
        rebalance: float | None = None,
        energy_limit: float | None = None,
        second_order: bool = False,
        accuracy: float | None = None,
        conversion: Conversion | None = CONVERSION,
    ) -> Reports[ImplicitReport]:
        """Run the implicit scheme (section 3 of the paper) with steps far beyond the critical one.

        A step that does not converge is repeated with half its length; the length grows again when steps converge easily.

        Args:
            until: time to reach [s].
            dt: largest time step [s].
            solver: solver of each step; Newton's method by default.
            every: time between reports [s]; by default there is one after each step.
            every_steps: steps between reports, counted since the model was made.
            since: time from which ``every`` counts [s]; by default the present, see ``explicit``.
            watch: function that is called after each step, on all ranks alike; it may save the model. When it returns true (on
                all ranks), the run ends with a report.
            quasi_static: leave inertia out. Loads and supports depend on time, and the particles are at rest at the end.
            damping: local damping alpha, in [0, 1). Its effect on elastic oscillations that the step does not resolve
                is a drag on the slide, as in the explicit scheme. Without effect in quasi-static runs.
            rayleigh: damping as by ``Rayleigh(mass=5.0, plastic_strain=np.inf)``, the only kind; not in quasi-static runs.
            pic: PIC fraction: the part of the particles' own velocities that the nodal velocities replace in a critical time
                step, in [0, 1]; 0 is FLIP. A step of dt takes 1 - (1 - pic)^(dt / dt_cr), so that the effect does not depend on
                the step.
            nmd: average volumetric strains over nodes (nodal mixed discretisation).
            integration: how stresses become forces: PARTICLES or MIXED; by default as in ``explicit``.
            ghost: ghost penalty, against nodes that carry hardly any mass; ``GhostPenalty()`` by default.
            small_displacements: change the particles' stresses but not their positions and volumes, for quasi-static runs;
                ``particles.displacement`` counts the displacements all the same. With ``nmd``, strains and nodal forces are
                averaged as in the finite elements, so that the tangent is symmetric for associated flow. Pressures of nearly
                incompressible soil may then alternate from cell to cell.
            rebalance: see ``explicit``; checked before each step.
            energy_limit: see ``explicit``; by default none. What the scheme dissipates counts as unexplained.
            second_order: use a method of second order in time with two stages per step (Alexander 1977) instead of backward
                Euler, the paper's scheme. It hardly dissipates motion that the steps resolve; a step costs twice as much. Without
                damping only.
            accuracy: for steps of second order, the permitted error of a step in displacement [m], as the root mean square
                weighted by mass; an estimate of it determines the length of the steps, up to ``dt``. By default all are ``dt``.
            conversion: when resting cells turn into particles, as for ``explicit``; looked at after each step.

        Raises:
            InputError: an argument out of its range.
            RunError: a step of dt / 1024 did not converge, or a particle left the mesh; with the reason. The
                particles have the state after the last step that converged.
        """
        refuse_driven_bodies(self, "the implicit scheme", second_order=second_order)
        refuse_drag(self, "the implicit scheme")
        refuse_members(self, "the implicit scheme")
        if small_displacements:
            refuse_contacts(self, "the implicit scheme with small_displacements")
        if isinstance(solver, Relaxation):
            refuse_contacts(self, "relaxation")
        refuse_absorbing(self, "the implicit scheme")
        self._check_water()
        refuse_two_phases(self, "implicit()")
        if second_order:
            refuse_water(self, "the scheme of second order")
        if isinstance(solver, Relaxation):
            refuse_water(self, "relaxation")
        integration = integration_of(self, integration)
        options, longest, times, steps, threshold, limit, wanted, method, _ = collectively(
            self.comm,
            lambda: (
                implicit_options(
                    damping, pic, nmd, integration, quasi_static, ghost, small_displacements, second_order, rayleigh
                ),
                positive("dt", dt, "s"),
                report_times(self, until, every, since),
                steps_between(1 if every is None and every_steps is None else every_steps),
                rebalance_threshold(rebalance),
                checked_energy_limit(energy_limit),
                checked_accuracy(accuracy, second_order),
                of_kind("solver", solver or Newton(), Newton, Relaxation),
                watcher(watch),
            ),
        )
        core_conversion = checked_conversion(self, conversion, integration)
        require_particles(self)
        require_new_soil_outside(self)
        warn_of_setup(self, nmd, until=until)
        reports = run_implicit(
            self, method, options, times=times, dt=longest, watch=watch, every_steps=steps, rebalance=threshold,
            energy_limit=limit, accuracy=wanted, conversion=core_conversion,
        )  # fmt: skip
        return Reports(reports, "implicit", self, until)

    def equilibrate(
        self,
        *,
        solver: Newton | Relaxation | None = None,
        nmd: bool = False,
        integration: Integration | None = None,
        ghost: GhostPenalty | None = None,
        tolerance: float = 1e-6,
        max_steps: int = 20,
        small_displacements: bool = False,
        averaged_forces: bool = True,
    ) -> ImplicitReport:
        """Bring the particles to equilibrium under the present loads, by quasi-static steps without duration.

        This is needed after an imported initial state, and after particles have moved to other cells, when their stresses
        no longer balance the loads. Velocities become zero. The first step moves the particles, the others only change
        their stresses. Supports with a prescribed velocity stand still.

        Args:
            solver: solver of each step; Newton's method by default.
            nmd: average volumetric strains over nodes, and mean stresses for the nodal forces (nodal mixed discretisation), as
                explicit steps with ``nmd`` do; with ``small_displacements`` and without water as finite elements do.
            integration: how stresses become forces: PARTICLES or MIXED; by default as in ``explicit``.
            ghost: ghost penalty, against nodes that carry hardly any mass; ``GhostPenalty()`` by default.
            tolerance: out-of-balance ratio |f_ext - f_int| / |f_ext| to reach, in the state after a step.
            max_steps: largest number of steps.
            small_displacements: change the particles' stresses but not their positions and volumes; see ``implicit``.
            averaged_forces: false for implicit steps with ``nmd`` that move particles: they average strains only, so that forces
                without averages balance the loads.

        Raises:
            InputError: an argument out of its range; a model with contact, absorbing sides, several velocity fields or water that
                has a velocity of its own.
            RunError: no equilibrium within ``max_steps``, or a step that did not converge.
        """
        refuse_beyond_equilibrium(self, integration)
        integration = integration_of(self, integration)
        options, method, ratio, most_steps = collectively(
            self.comm,
            lambda: (
                implicit_options(
                    0.0,
                    0.0,
                    nmd,
                    integration,
                    True,
                    ghost,
                    small_displacements,
                    averaged_forces=averaged_forces,
                ),
                of_kind("solver", solver or Newton(), Newton, Relaxation),
                positive("tolerance", tolerance, "(a ratio)"),
                count("max_steps", max_steps),
            ),
        )
        return find_equilibrium(self, method, options, ratio, most_steps)
