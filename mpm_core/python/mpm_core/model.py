"""A model: background mesh, particles, laws, loads and supports; and the explicit scheme over it."""

import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core, checkpoint
from ._core import InputError, StressUpdate
from .collective import collectively
from .ghost import GhostPenalty
from .implicit import run_implicit, settle
from .mesh import Mesh, cell_sizes, floats
from .newton import Newton
from .particles import Particles
from .relaxation import Relaxation
from .report import ImplicitReport, Report


def _positive(name: str, value: float, unit: str, *, zero: bool = False) -> float:
    if not (np.isfinite(value) and (value >= 0 if zero else value > 0)):
        raise InputError(
            f"{name} is {value} {unit}, expected a {'number not below zero' if zero else 'positive number'}"
        )
    return float(value)


def _within(name: str, value: float, low: float, high: float, *, open_above: bool = False) -> float:
    if not (low <= value < high or (value == high and not open_above)):
        raise InputError(f"{name} is {value}, expected {low} <= {name} {'<' if open_above else '<='} {high}")
    return float(value)


class Model:
    """Soil as particles on a background mesh.

    Args:
        mesh: the background mesh.
        laws: one constitutive law, or several that seeding chooses by number.

    Raises:
        InputError: no law, or something that is none.

    Note:
        Collective, as all methods are unless they say otherwise.
    """

    def __init__(self, mesh: Mesh, laws: Any | Sequence[Any]) -> None:
        self.mesh = mesh
        self.comm: MPI.Comm = mesh.comm
        self.laws = list(laws) if isinstance(laws, (list, tuple)) else [laws]
        for law in self.laws:
            if not isinstance(law, tuple(_core.law_types)):
                raise InputError(f"laws has {law!r}, expected constitutive laws such as MohrCoulomb(...)")
        if not self.laws:
            raise InputError("laws is empty, expected at least one constitutive law")
        core_type = _core.Model2 if mesh.dim == 2 else _core.Model3
        self._core = core_type(mesh._core, self.laws, MPI._addressof(self.comm))
        self._wishes: list[tuple[int, bool, list[float]]] = []
        self._prescribed: dict[int, tuple[int, bool, list[float]]] = {}
        self._next_id = 0
        self.particles = Particles(self._core, mesh.dim)
        """The particles on this rank."""

    # --- particles -----------------------------------------------------------------------------------------------

    def _seeded(self, added: int, ids: int) -> int:
        self._next_id += ids
        if any("cell_size" in law.state_names for law in self.laws):
            sizes, seen = cell_sizes(self.mesh)[self.particles.cell], self.state("cell_size")
            self.set_state("cell_size", np.where(seen == 0, sizes, seen))
        return self.comm.allreduce(added)

    def _material(self, material: int) -> int:
        if not 0 <= material < len(self.laws):
            raise InputError(f"material is {material}, expected 0 to {len(self.laws) - 1}, the number of a law")
        return material

    def seed(self, *, density: float, per_cell: int = 10, cell_tag: int | None = None, material: int = 0) -> int:
        """Place particles evenly in cells, each with the same share of its cell's volume.

        Args:
            density: [kg/m3].
            per_cell: particles per cell: 1, 3, 4, 6, 10, 12, ... in a triangle; 1, 4, 8, 10, ... in a tetrahedron.
            cell_tag: cells with this tag; all cells by default.
            material: number of their law.

        Returns:
            Number of particles placed, over all ranks.

        Raises:
            InputError: a density that is not positive, a number that does not fill a cell evenly, an unknown tag or law.
        """

        def place() -> int:
            if cell_tag is not None:
                self.mesh.require_tag("cell", cell_tag)
            rho = _positive("density", density, "kg/m3")
            if isinstance(per_cell, bool) or not isinstance(per_cell, (int, np.integer)):
                raise InputError(f"per_cell is {per_cell}, expected a whole number")
            return self._core.seed_cells(cell_tag, int(per_cell), self._material(material), rho, self._next_id)

        return self._seeded(collectively(self.comm, place), self.mesh.cell_numbers * int(per_cell))

    def seed_points(self, points: ArrayLike, volumes: ArrayLike, *, density: float, material: int = 0) -> int:
        """Place one particle at each given point. Every rank gives the same points.

        Args:
            points: [m], shape (n, D).
            volumes: [m^D], shape (n,), positive.
            density: [kg/m3].
            material: number of their law.

        Returns:
            Number of particles placed, over all ranks.

        Raises:
            InputError: wrong shape, a point outside of the mesh, a volume or density that is not positive.
        """

        def place() -> int:
            x = floats("points", points, (None, self.mesh.dim))
            v = floats("volumes", volumes, (len(x),))
            if (v <= 0).any():
                raise InputError(f"volumes is {v.min()} m^{self.mesh.dim} at least, expected positive numbers")
            rho = _positive("density", density, "kg/m3")
            return self._core.seed_points(x, v, self._material(material), rho, self._next_id)

        inside = collectively(self.comm, lambda: self._owned(points))
        total = self.comm.allreduce(inside, MPI.MAX)
        if not total.all():
            first = int(np.argmin(total))
            raise InputError(f"points has {np.asarray(points)[first]} at row {first}, which is outside of the mesh")
        return self._seeded(collectively(self.comm, place), len(np.asarray(points)))

    def _owned(self, points: ArrayLike) -> Any:
        cells = self.mesh.cells_of(points)
        return (cells >= 0) & (cells < self.mesh.owned_cells)

    def traction(self, facet_tag: int, traction: ArrayLike) -> float:
        """Load the particles next to the facets with a tag (15). The force moves with them and keeps its direction.

        Args:
            facet_tag: tag of the loaded facets.
            traction: force per area [Pa], shape (D,).

        Returns:
            Area of the loaded facets [m^(D-1)] over all ranks.
        """

        def load() -> float:
            self.mesh.require_tag("facet", facet_tag)
            return self._core.load_facets(facet_tag, floats("traction", traction, (self.mesh.dim,)).tolist())

        area = self.comm.allreduce(collectively(self.comm, load))
        if area == 0:
            raise InputError(f"facet_tag {facet_tag} has no filled cell behind it to carry the traction")
        return area

    def state(self, name: str) -> NDArray[np.float64]:
        """A state variable by its name in ``state_names`` of the laws, such as "excess_pore_pressure".

        Returns:
            Shape (n,), in the order of ``particles``; NaN where a particle's law has no such variable. Not collective.
        """
        state, material = self.particles.state, self.particles.material
        values = np.full(len(material), np.nan)
        for number, column in self._state_columns(name):
            values[material == number] = state[material == number, column]
        return values

    def set_state(self, name: str, values: ArrayLike) -> None:
        """Overwrite a state variable by its name, in the particles whose law has it; shape (n,). Not collective."""
        state, material = self.particles.state, self.particles.material
        new = np.asarray(values, dtype=np.float64)
        if new.shape != material.shape:
            raise InputError(f"values has shape {new.shape}, expected {material.shape}, one for each particle")
        for number, column in self._state_columns(name):
            state[material == number, column] = new[material == number]
        self.particles.set("state", state)

    def _state_columns(self, name: str) -> list[tuple[int, int]]:
        """(number of a law, column of the state variable) for each law that has it."""
        columns = [(k, law.state_names.index(name)) for k, law in enumerate(self.laws) if name in law.state_names]
        if not columns:
            known = sorted({known for law in self.laws for known in law.state_names})
            raise InputError(f"name is '{name}', expected a state variable of the laws: {', '.join(known)}")
        return columns

    def assign(self, material: ArrayLike) -> None:
        """Give each particle its law: numbers of laws, shape (n,), in the order of ``particles``. Not collective.

        Example:
            >>> model.assign(np.where(model.particles.position[:, 1] < 2.0, 1, 0))  # layers
        """
        numbers = np.asarray(material)
        if numbers.shape != (len(self.particles),) or not np.issubdtype(numbers.dtype, np.integer):
            raise InputError(
                f"material has shape {numbers.shape} and dtype {numbers.dtype}, expected one whole number each"
            )
        for number in np.unique(numbers):
            self._material(int(number))
        self._core.set_materials(np.ascontiguousarray(numbers, dtype=np.int32))

    def place(self, position: ArrayLike) -> None:
        """Put the particles elsewhere: their cells are found anew, on whatever rank, and their displacement changes with it.

        The particles may have another order, and other ranks, afterwards.

        Args:
            position: [m], shape (n, D), in the order of ``particles``.

        Raises:
            InputError: on all ranks, naming a particle that would be outside of the mesh; then none is moved.
        """

        def checked() -> NDArray[np.float64]:
            return floats("position", position, (len(self.particles), self.mesh.dim))

        self._core.place_particles(collectively(self.comm, checked))

    # --- supports and loads --------------------------------------------------------------------------------------

    def _support(
        self, facet_tag: int, whole: bool, vector: ArrayLike, name: str, *, replaced: Any = None
    ) -> tuple[int, bool, list[float]]:
        def checked() -> tuple[int, bool, list[float]]:
            self.mesh.require_tag("facet", facet_tag)
            return facet_tag, whole, floats(name, vector, (self.mesh.dim,)).tolist()

        wish = collectively(self.comm, checked)
        wishes = [*(other for other in self._wishes if other is not replaced), wish]
        collectively(self.comm, lambda: self._core.set_supports(wishes))
        self._wishes = wishes
        return wish

    def fix(self, facet_tag: int) -> None:
        """Hold the nodes on facets with this tag."""
        self._support(facet_tag, True, [0.0] * self.mesh.dim, "velocity")

    def roller(self, facet_tag: int, normal: ArrayLike) -> None:
        """Let the nodes on facets with this tag move only at right angles to ``normal``, a direction of any length."""
        self._support(facet_tag, False, normal, "normal")

    def prescribe(self, facet_tag: int, velocity: ArrayLike) -> None:
        """Prescribe the velocity [m/s] of the nodes on facets with this tag, shape (D,); again, to change it."""
        before = self._prescribed.get(facet_tag)
        self._prescribed[facet_tag] = self._support(facet_tag, True, velocity, "velocity", replaced=before)

    def outflow(self, facet_tag: int) -> None:
        """Let particles leave the mesh through facets with this tag; they are counted in the report."""
        self._core.outflow_tags = [*self._core.outflow_tags, self.mesh.require_tag("facet", facet_tag)]

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Gravity [m/s2], shape (D,), as it is after any ramp. Not collective."""
        return np.array(self._core.gravity)

    def set_gravity(self, gravity: ArrayLike, ramp: float = 0.0) -> None:
        """Set gravity [m/s2], shape (D,); it rises linearly from zero over the first ``ramp`` seconds."""
        components = floats("gravity", gravity, (self.mesh.dim,)).tolist()
        self._core.gravity_ramp = _positive("ramp", ramp, "s", zero=True)
        self._core.gravity = components

    # --- checkpoints ---------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Save the complete state: particles, loads, supports, time and totals.

        The file is written aside as ``path.part``, flushed to the disk and renamed, so that a file of that name is whole at
        all times, also when the run is killed.

        Args:
            path: of the file, commonly ``NAME.h5``; the folder must exist.

        Raises:
            RunError: on all ranks, with path and reason, when it cannot be written; an older file stays as it is.
        """
        checkpoint.save(self, path)

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Take the state that ``save`` wrote; particles, loads and supports that the model has are replaced.

        On the same number of ranks (and partition) the run goes on as if it had never stopped, to the last bit; on another
        one up to the order of sums.

        Args:
            path: of the file. It must have been saved by a model with the same mesh and laws.

        Raises:
            InputError: a file of another mesh, of other laws or of another dimension.
            RunError: on all ranks, with path and reason: the file is not there, not a checkpoint, truncated, damaged or of an
                unknown format. The model is as it was.
        """
        checkpoint.restore(self, path)

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
        """Critical time step (16): smallest h_min / c_d over the particles [s]."""
        return self._core.critical_time_step()

    def out_of_balance(self, gravity: ArrayLike | None = None) -> float:
        """Out-of-balance over external force of the particles as they are: |f_ext - f_int| / |f_ext| over the nodes [-].

        Args:
            gravity: [m/s2], shape (D,), to weigh the particles with; by default the model's own, without its ramp.
        """
        g = self._core.gravity if gravity is None else floats("gravity", gravity, (self.mesh.dim,)).tolist()
        return self._core.out_of_balance(g)

    def report(self) -> Report:
        """Where the run stands."""
        values = self._core.diagnostics()
        values["momentum"] = tuple(values["momentum"][: self.mesh.dim])
        values["particle_steps"] = int(values["particle_steps"])
        return Report(time=self.time, steps=self._core.steps, dt=self._core.last_dt, **values)

    def nodal(self, name: str) -> Any:
        """A copy of a nodal field of the last step: velocity, acceleration, internal_force (nodes, D) or mass (nodes,)."""
        return self._core.nodal(name)

    def explicit(
        self,
        until: float,
        *,
        every: float | None = None,
        since: float | None = None,
        watch: Callable[[], bool] | None = None,
        dt: float | None = None,
        courant: float = 0.5,
        damping: float = 0.0,
        pic: float = 0.0,
        nmd: bool = False,
        stress_update: StressUpdate = StressUpdate.MODIFIED_LAST,
        allow_unstable: bool = False,
    ) -> Iterator[Report]:
        """Run the explicit scheme (16)-(20) of the paper; yields a report now and then and at the end.

        Args:
            until: time to reach [s].
            every: time between reports [s]; by default only at the end.
            since: time from which ``every`` counts [s]; by default the present. A run that goes on from a checkpoint gives
                the start of the first run, so that it meets the same times to the last bit.
            watch: called between steps, after every 32nd and before each report, on all ranks alike; the model may be
                saved then. When it returns true (on all ranks), the run ends with a report.
            dt: time step [s]; by default ``courant`` times the critical one, which is found anew as the soil changes.
            courant: alpha_c of (17), in (0, 1].
            damping: local damping alpha, in [0, 1).
            pic: share of the grid's velocity in the particles', in [0, 1]; 0 is FLIP.
            nmd: average volumetric strains over nodes (nodal mixed discretisation).
            stress_update: when stresses are updated: MODIFIED_LAST (MUSL), LAST (USL) or FIRST (USF).
            allow_unstable: take ``dt`` even above the critical time step.

        Raises:
            InputError: an argument out of its range; ``dt`` above the critical time step, with both numbers.
            RunError: a particle left the mesh, a value is not finite, a law failed; with the place.
        """
        options = _core.ExplicitOptions()
        options.damping = _within("damping", damping, 0, 1, open_above=True)
        options.pic_share = _within("pic", pic, 0, 1)
        options.mixed_discretisation = bool(nmd)
        options.stress_update = stress_update
        run = _core.RunOptions()
        run.dt = None if dt is None else _positive("dt", dt, "s")
        if not 0 < courant <= 1:
            raise InputError(f"courant is {courant}, expected 0 < courant <= 1")
        run.courant = courant
        run.allow_unstable = bool(allow_unstable)
        if not (np.isfinite(until) and until >= self.time):
            raise InputError(f"until is {until} s, expected a time not before the present, {self.time} s")
        start = self.time if since is None else float(since)
        if not start <= self.time:
            raise InputError(f"since is {since} s, expected a time not after the present, {self.time} s")
        interval = until - start if every is None else _positive("every", every, "s")
        if self.comm.allreduce(len(self.particles)) == 0:
            raise InputError("the model has no particles, seed some first")
        count = max(1, int(np.ceil((until - start) / interval - 1e-9))) if until > start else 0
        done = int(np.floor((self.time - start) / interval + 1e-9)) if until > start else 0
        times = [until if k == count else start + k * interval for k in range(done + 1, count + 1)]
        return self._run_explicit(options, run, times, watch)

    def _run_explicit(
        self, options: Any, run: Any, times: Sequence[float], watch: Callable[[], bool] | None
    ) -> Iterator[Report]:
        # Python must get its turn now and then, for Ctrl-C. The pauses do not change the steps, which are chosen anew
        # after each control interval anyway.
        most = max(1, self.comm.allreduce(len(self.particles), MPI.MAX))
        pauses = 1 if watch is not None else max(1, 2_000_000 // most // _core.control_interval)
        run.max_steps = pauses * _core.control_interval
        for until in times:
            run.until = until
            while self.time < until:
                self._core.run_explicit(options, run)
                if watch is not None and watch():
                    yield self.report()
                    return
            yield self.report()

    def implicit(
        self,
        until: float,
        *,
        dt: float,
        solver: Newton | Relaxation | None = None,
        every: float | None = None,
        quasi_static: bool = False,
        damping: float = 0.0,
        pic: float = 0.0,
        nmd: bool = False,
        ghost: GhostPenalty | None = None,
    ) -> Iterator[ImplicitReport]:
        """Run the implicit scheme (section 3 of the paper): backward Euler, with steps far beyond the critical one.

        A step that does not converge is tried again with half its length; the length grows again when it is easy.

        Args:
            until: time to reach [s].
            dt: longest time step [s].
            solver: what solves each step; Newton's method by default.
            every: time between reports [s]; by default after each step.
            quasi_static: leave inertia out. Time then only drives loads and supports, and the particles end at rest.
            damping: local damping alpha, in [0, 1). Acts on the out-of-balance force of the step's end; not in
                quasi-static runs.
            pic: share of the grid's velocity in the particles', in [0, 1]; 0 is FLIP.
            nmd: average volumetric strains over nodes (nodal mixed discretisation).
            ghost: remedy for nodes that carry hardly any mass; ``GhostPenalty()`` by default.

        Raises:
            InputError: an argument out of its range.
            RunError: a step of dt / 1024 did not converge either, or a particle left the mesh; with the reason. The
                particles are as after the last step that converged.
        """
        options = self._implicit_options(damping, pic, nmd, quasi_static, ghost)
        longest = _positive("dt", dt, "s")
        interval = None if every is None else _positive("every", every, "s")
        if not (np.isfinite(until) and until >= self.time):
            raise InputError(f"until is {until} s, expected a time not before the present, {self.time} s")
        return run_implicit(self, solver or Newton(), options, until=until, dt=longest, interval=interval)

    def equilibrate(
        self,
        *,
        solver: Newton | Relaxation | None = None,
        nmd: bool = False,
        ghost: GhostPenalty | None = None,
        tolerance: float = 1e-6,
        max_steps: int = 20,
    ) -> ImplicitReport:
        """Bring the particles to equilibrium under the present loads, by quasi-static steps of no duration.

        Needed after an imported initial state, and after convection, where the particles' stresses no longer balance the
        loads. Velocities become zero. The first step moves the particles, the others only change their stresses.

        Args:
            solver: what solves each step; Newton's method by default.
            nmd: average volumetric strains over nodes (nodal mixed discretisation).
            ghost: remedy for nodes that carry hardly any mass; ``GhostPenalty()`` by default.
            tolerance: |f_ext - f_int| / |f_ext| to reach, at nodes and particles as they are after a step.
            max_steps: steps after which to give up.

        Raises:
            RunError: no equilibrium within ``max_steps``, or a step that did not converge.
        """
        options = self._implicit_options(0.0, 0.0, nmd, True, ghost)
        return settle(self, solver or Newton(), options, _positive("tolerance", tolerance, "(a ratio)"), max_steps)

    def _implicit_options(
        self, damping: float, pic: float, nmd: bool, quasi_static: bool, ghost: GhostPenalty | None
    ) -> Any:
        options = _core.ImplicitOptions()
        options.damping = _within("damping", damping, 0, 1, open_above=True)
        options.pic_share = _within("pic", pic, 0, 1)
        options.mixed_discretisation = bool(nmd)
        options.quasi_static = bool(quasi_static)
        options.ghost = (ghost or GhostPenalty()).options()
        if self.comm.allreduce(len(self.particles)) == 0:
            raise InputError("the model has no particles, seed some first")
        return options
