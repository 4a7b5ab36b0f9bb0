"""Stages of construction by quasi-static particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from mpm_core.parameter_fields import differences_of
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import InputError, agree, real_numbers
from fenics_bridge.fem.at_rest import warn_beyond_strength
from fenics_bridge.fem.deconfinement import refuse_held, require_released
from fenics_bridge.fem.fem_site import FemSite
from fenics_bridge.fem.overconsolidation import before_equilibrium, hardened, upward
from fenics_bridge.fem.small_strains import without_memory
from fenics_bridge.fem.stages import SiteState, Stage, StageError, StageReport
from fenics_bridge.fem.strength_ratio import STRENGTH, StrengthRatio, strengths, vertical_stress
from fenics_bridge.fem.supports import Support, not_supports
from fenics_bridge.transfer.handover import Handover, initialise
from fenics_bridge.transfer.particle_forces import boundary_forces, seepage_forces
from fenics_bridge.transfer.particles_at_rest import carried_stress, place_at_rest, stress_at_rest


class ParticleSite:
    """Particles that are placed and removed in stages, see `Stage` and `carry_out`; equilibrium is quasi-static. Collective.

    Soils and boundaries are the tags of the model's mesh. A stage places particles in the cells of a soil, or removes those
    that lie in them.

    Args:
        model: model without particles, with all laws that the stages will need; gravity acts on the last axis.
        materials: number of its law in the model by soil (name or number of its tag).
        supports: boundary conditions as for `QuasiStatic`, without prescribed displacements.
        gravity: acceleration of gravity [m/s2], by which unit weights become densities.
        per_cell: particles per cell, as for `Model.seed`; by default 3 in a triangle and 4 in a tetrahedron.
        small_displacements: keep the particles at their places, as the finite elements do; otherwise they move.
        **options: options of `Model.equilibrate` for each stage: solver, nmd, ghost, tolerance, max_steps.

    Raises:
        InputError: the model has particles, a support prescribes a displacement, or a soil or boundary does not exist. Raised on
            all ranks alike.
    """

    def __init__(
        self,
        model: mpm.Model,
        materials: Mapping[int | str, int],
        supports: Sequence[Support],
        *,
        gravity: float = 9.81,
        per_cell: int | None = None,
        small_displacements: bool = False,
        **options: Any,
    ) -> None:
        comm, mesh = model.comm, model.mesh
        agree(comm, None if comm.allreduce(len(model.particles)) == 0 else "model has particles, expected none yet")
        self.model = model
        """The particles"""
        self.number = 0
        """Number of the last stage, from 1 on; 0 before the first one"""
        self._per_cell, self._g = mesh.dim + 1 if per_cell is None else per_cell, gravity
        self._options: dict[str, Any] = {"small_displacements": small_displacements, **options}
        names = {tags[0]: repr(name) for name, tags in mesh.names["cell"].items() if len(tags) == 1}
        self.state = SiteState(
            comm,
            lambda given, argument: _tags(model, "cell", given, argument),
            lambda given, argument: _tags(model, "facet", given, argument),
            name_of=lambda tag: names.get(tag, str(tag)),
            supports=supports,
        )
        """Which soils have been placed, their weights, loads and supports"""
        self._material = {tag: n for soil, n in materials.items() for tag in _tags(model, "cell", soil, "materials")}
        self._seeded: list[tuple[int, int, int]] = []  # first id, end of ids, soil
        model.set_gravity([0.0] * (mesh.dim - 1) + [-gravity])
        apply_supports(model, self.state.supports)

    def __repr__(self) -> str:
        return f"<ParticleSite: after stage {self.number}; {self.model!r}>"

    def carry_out(self, stage: Stage) -> StageReport:
        """Bring the particles to equilibrium after a stage's changes. Collective.

        Args:
            stage: the changes.

        Returns:
            Report of the stage.

        Raises:
            InputError: the stage has an unknown soil or boundary, a law that the model was not made with, a load on resting
                cells, or a layer in cells that other soil has moved into; nothing has been changed. Raised on all ranks alike.
            StageError: there is no equilibrium; the particles are then in the last equilibrium of the stage.
        """
        model = self.model
        state, fill, excavate = self.state.after(stage)
        self._refuse_members(stage)
        require_released(model.comm, stage, "particles release all forces at once; take over those of a FemSite")
        material = {
            **self._material,
            **{tag: self._number_of(state.law[tag], stage) for tag in stage_laws(stage, state)},
        }
        without = next((tag for tag in fill if tag not in material), None)
        problem = (
            f"materials has no law for the soil {self.state._name_of(without)}, expected one"
            if without is not None
            else None
        )
        agree(model.comm, problem)
        self._refuse_resting(state, stage)
        self._refuse_occupied(fill, stage)
        k0, laws = state.k0_of(stage), {tag: model.laws[material[tag]] for tag in state.there}
        ratios, weak = state.overconsolidation_of(stage, laws), state.strength_ratio_of(stage, laws)
        at_rest, carried = (
            stress_at_rest(self, state, laws, k0, gravity=self._g, per_cell=self._per_cell, **self._options)
            if k0
            else ({}, {})
        )
        if stage.reset_displacement:
            model.particles.set("initial_position", model.particles.position)
        model.remove(np.isin(model.mesh.cell_tags[model.particles.cell], excavate))
        vertical = self._vertical_stress([tag for tag in weak if tag not in fill])
        self._change_laws(material)
        first = model._next_id
        for tag in fill:
            self._fill(tag, state.unit_weight[tag], stage)
        placed = {tag: self.rows_of(tag) & (model.particles.id >= first) for tag in at_rest}
        vertical |= {
            tag: (np.sort(model.particles.id[placed[tag]]), -stress[:, upward(stress.shape[1])])
            for tag, stress in carried.items()
            if tag in weak
        }
        self._strengthen(weak, vertical, laws)
        harden = partial(self._harden, before_equilibrium(ratios, laws))
        if at_rest:
            given, admissible = place_at_rest(model, at_rest, placed, harden)
            warn_beyond_strength(model.comm, f"stage {stage.name!r}: ", given, admissible)
        else:
            harden()  # of the stresses that the stage gives
        self._weigh(state)
        apply_supports(model, state.supports)
        self._load(state)
        self.state, self.number = state, self.number + 1
        try:
            report = model.equilibrate(**self._options)
        except mpm.RunError as error:
            raise StageError(self._failure(stage, error), float(getattr(error, "applied", 0.0))) from error
        self._harden(ratios)
        if self.number == 1:
            self._rest()
        p = model.particles
        moved = np.linalg.norm(p.displacement, axis=1).max(initial=0.0)
        return StageReport(
            self.number, stage.name, report.cuts + 1, report.iterations, max(model.comm.allgather(float(moved)))
        )

    def take_over(self, site: FemSite) -> Handover:
        """Begin from finite elements after their stages, with their structural members, in the place of own stages. Collective.

        Particles get loads, water, stress and state of the finite elements, and no displacement. They are not brought to
        equilibrium: what is out of balance is round-off with linear elements on the same cells that average as particles do, and
        after a stage that failed the part of its change that had no equilibrium.

        Args:
            site: finite elements on the same mesh, or on a part of it with the same tags.

        Returns:
            What `initialise` reports.

        Raises:
            InputError: particles have had a stage, a soil has no law, or as `initialise`. Raised on all ranks alike.
        """
        model, state = self.model, site.state
        refuse_held(model.comm, site.fem)
        agree(
            model.comm,
            f"stage {self.number} has been carried out, expected none before take_over" if self.number else None,
        )
        stage = Stage("take over")
        laws = {tag: self._number_of(law, stage) for tag, law in state.law.items()}
        self._material = {**self._material, **laws}
        without = next((tag for tag in state.there if tag not in self._material), None)
        name = "" if without is None else self.state._name_of(without)
        agree(model.comm, f"materials has no law for the soil {name}, expected one" if name else None)
        for tag in state.there:
            self._fill(tag, state.unit_weight[tag], stage)
        apply_supports(model, state.supports)
        self._load(state)
        self.state, self.number = self.state.at(state), site.number
        fem, nmd, reached = site.fem, self._options.get("nmd"), (site.fem.converged, site.fem.load)
        # After a stage that failed, too, they are in equilibrium with what acts of it; what is still held moves the particles.
        fem.converged, fem.load = True, replace(fem.load, held=0.0)
        try:
            return initialise(model, fem, count_displacement=False, equilibrate=False, nmd=nmd)
        finally:
            fem.converged, fem.load = reached

    def _refuse_members(self, stage: Stage) -> None:
        where, expected = f"stage {stage.name!r}: ", "quasi-static particles have no members"
        problem = None
        if stage.install:
            problem = f"{where}install is {list(stage.install)}, expected none: {expected}; take_over has those of finite elements"
        elif self.model.members:
            problem = f"{where}the model has the members {list(self.model.members)}, expected no stage after take_over: {expected}"
        agree(self.model.comm, problem)

    def rows_of(self, soil: int | str) -> NDArray[np.bool_]:
        """Whether each particle of this rank is of a soil. Collective.

        Args:
            soil: name or number of the soil's tag.

        Returns:
            Shape (n,).

        Raises:
            InputError: no cell has the tag. Raised on all ranks alike.
        """
        tags, ids = _tags(self.model, "cell", soil, "soil"), self.model.particles.id
        rows = np.zeros(len(ids), dtype=bool)
        for first, end, tag in self._seeded:
            rows |= (ids >= first) & (ids < end) & (tag in tags)
        return rows

    def _fill(self, tag: int, unit_weight: Any, stage: Stage) -> None:
        model, first = self.model, self.model._next_id
        model.seed(density=unit_weight / self._g, per_cell=self._per_cell, cell_tag=tag, material=self._material[tag])
        self._seeded.append((first, model._next_id, tag))
        if stage.stress is not None:
            stress, rows = model.particles.stress.copy(), self.rows_of(tag) & (model.particles.id >= first)
            given = real_numbers(model.comm, "stress", stage.stress(model.particles.position[rows]))
            expected = stress[rows].shape
            good = given.shape == expected and np.all(np.isfinite(given))
            agree(model.comm, None if good else f"stress has shape {given.shape}, expected finite {expected}")
            stress[rows] = given
            model.particles.set("stress", stress)

    def _number_of(self, law: Any, stage: Stage) -> int:
        numbers = [number for number, known in enumerate(self.model.laws) if known is law]
        message = f"stage {stage.name!r}: law: {law!r} is not among the laws that the model was made with"
        agree(self.model.comm, None if numbers else message)
        return numbers[0]

    def _change_laws(self, material: Any) -> None:
        model = self.model
        numbers, state, changed = model.particles.material.copy(), model.particles.state.copy(), False
        for tag, number in material.items():
            if number != self._material.get(tag):
                rows = self.rows_of(tag)
                numbers[rows], state[rows], changed = number, 0.0, True
        self._material = material
        if changed:
            model.assign(numbers)
            model.particles.set("state", state)
            model._seeded(0, 0)  # gives laws that ask for it the size of the cells

    def _vertical_stress(self, soils: Sequence[int]) -> dict[int, tuple[NDArray[np.int64], NDArray[np.float64]]]:
        """Numbers of the particles of soils in rising order, and their vertical effective stresses [Pa], compression positive, by tag."""
        if not soils:
            return {}
        p, found = self.model.particles, {}
        stress = carried_stress(self.model, bool(self._options.get("nmd")))
        for tag in soils:
            rows, law = np.flatnonzero(self.rows_of(tag)), self.model.laws[self._material[tag]]
            rows = rows[np.argsort(p.id[rows])]
            found[tag] = p.id[rows], vertical_stress(law, stress[rows], p.state[rows, : law.n_state])
        return found

    def _strengthen(
        self,
        ratios: Mapping[int, StrengthRatio],
        vertical: Mapping[int, tuple[NDArray[np.int64], NDArray[np.float64]]],
        laws: Mapping[int, Any],
    ) -> None:
        """Give the particles of soils the undrained strength of strength ratios, by tag, under vertical stresses of `_vertical_stress`."""
        if not ratios:
            return
        p = self.model.particles
        values = np.full(len(p), np.nan)  # others keep theirs
        for tag, ratio in ratios.items():
            of_soil, stress = vertical[tag]
            rows = np.flatnonzero(np.isin(p.id, of_soil))
            here = stress[np.searchsorted(of_soil, p.id[rows])]
            values[rows] = strengths(laws[tag], ratio, here, p.position[rows])
        p.set("state", differences_of(STRENGTH, values, self.model.laws, p.material, p.state))

    def _harden(self, ratios: Mapping[int, float]) -> None:
        """Give the particles of soils the hardening of overconsolidation ratios [-], by tag, under their present stresses."""
        p, laws = self.model.particles, self.model.laws
        states = p.state.copy()
        for tag, ratio in ratios.items():
            rows, law = self.rows_of(tag), laws[self._material[tag]]
            states[rows, : law.n_state] = hardened(law, p.stress[rows], states[rows, : law.n_state], ratio)
        if ratios:
            p.set("state", states)

    def _rest(self) -> None:
        """Let the ground forget the small strains of its first stage."""
        p = self.model.particles
        states = p.state.copy()
        for number, law in enumerate(self.model.laws):
            rows = p.material == number
            states[rows, : law.n_state] = without_memory(law, states[rows, : law.n_state])
        p.set("state", states)

    def _weigh(self, state: SiteState) -> None:
        """Scale masses by the ratio of the new unit weights to the old ones; undeformed volumes are not stored."""
        mass = self.model.particles.mass.copy()
        for tag in self.state.there:
            if tag in state.there and state.unit_weight[tag] != self.state.unit_weight[tag]:
                mass[self.rows_of(tag)] *= state.unit_weight[tag] / self.state.unit_weight[tag]
        self.model.particles.set("mass", mass)

    def _load(self, state: SiteState) -> Any:
        """Forces of pressures and pore water on the particles; they replace those of the stage before."""
        model = self.model
        force = np.zeros((len(model.particles), model.mesh.dim))
        for tag, pressure in state.pressure.items():
            force += boundary_forces(model, tag, pressure)
        if state.pore_pressure is not None:
            force += seepage_forces(model, state.pore_pressure)
        model.particles.set("traction", force)

    def _refuse_resting(self, state: SiteState, stage: Stage) -> None:
        """Raise InputError, on all ranks, where pressures or pore water would load resting cells. Collective."""
        model, rests = self.model, self.model.particles.is_resting
        if not model._core.has_resting_cells:
            return
        pressed = np.isin(model.mesh._core.facet_tags[model.particles.cell[rests]], list(state.pressure))
        loaded = {"pressure": pressed}
        if state.pore_pressure is not None:
            loaded["pore_pressure"] = seepage_forces(model, state.pore_pressure)[rests] != 0
        for name, rows in loaded.items():
            count = model.comm.allreduce(int(np.count_nonzero(rows.any(axis=1))))
            message = (
                f"stage {stage.name!r}: {name} would load {count} resting cells, expected particles to carry it: turn the cells "
                "there into particles first, by Model.convert"
            )
            agree(model.comm, message if count else None)

    def _refuse_occupied(self, fill: Sequence[int], stage: Stage) -> None:
        """Raise InputError, on all ranks, where other soil has moved into the cells of a layer that is placed. Collective."""
        model = self.model
        occupied = model.mesh.cell_tags[np.unique(model.particles.cell)]
        for tag in fill:
            count = model.comm.allreduce(int(np.count_nonzero(occupied == tag)))
            message = (
                f"stage {stage.name!r}: fill: other soil has moved into {count} cells of the soil {self.state._name_of(tag)}, expected "
                "empty cells: remove its particles there first, by Model.remove, or take small_displacements=True"
            )
            agree(model.comm, message if count else None)

    def _failure(self, stage: Stage, error: Any) -> Any:
        return (
            f"stage {self.number} ({stage.name!r}) has no equilibrium of the particles: {error}. Either the ground fails: take a "
            "smaller change, more strength or more support, or follow the failure by the explicit or implicit scheme; or "
            "Newton's method gave up: try more dilation, small_displacements, a larger tolerance, or solver=Relaxation()."
        )


def apply_supports(model: mpm.Model, supports: Sequence[Support]) -> None:
    """Give particles the supports of finite elements, in place of their earlier boundary conditions. Collective.

    Args:
        model: the particles.
        supports: boundary conditions as for `QuasiStatic`.

    Raises:
        InputError: what is given is no list of supports, one prescribes a displacement, or a boundary does not exist. Raised on all
            ranks alike.
    """
    agree(model.comm, not_supports(supports))
    for support in supports:
        if any(support.displacement or ()):
            raise InputError(f"supports: {support} prescribes a displacement, expected only zeros for particles")
    dim = model.mesh.dim
    model._set_supports([])
    for support in supports:
        held = support.displacement or (0.0,) * dim
        if None not in held:
            model.fix(support.facet_tag)
        else:
            for axis in range(dim):
                if held[axis] is not None:
                    model.roller(support.facet_tag, np.eye(dim)[axis])


def stage_laws(stage: Stage, state: SiteState) -> Any:
    """Tags of the soils whose law a stage gives."""
    return [tag for tag, law in state.law.items() if any(law is given for given in stage.law.values())]


def _tags(model: mpm.Model, kind: str, given: Any, argument: str) -> Any:
    try:
        return model.mesh.tags_of(kind, given)
    except mpm.InputError as error:
        raise InputError(f"{argument}: {error}") from None
