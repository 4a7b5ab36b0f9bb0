"""Stages of construction by finite elements."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
from mpm_core.members import Member, of_members
from numpy.typing import NDArray

from fenics_bridge.compat import cell_dofs
from fenics_bridge.errors import agree
from fenics_bridge.fem.active_cells import cells_there, reconfigure, switch_off
from fenics_bridge.fem.at_rest import rows_of, stress_at_rest, warn_beyond_strength
from fenics_bridge.fem.deconfinement import reached_by, require_released
from fenics_bridge.fem.load_steps import LoadStep
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.overconsolidation import before_equilibrium, hardened, upward
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.fem.small_strains import without_memory
from fenics_bridge.fem.stages import SiteState, Stage, StageError, StageReport, require_stages
from fenics_bridge.fem.strength_ratio import STRENGTH, StrengthRatio, strengths, vertical_stress
from fenics_bridge.mesh.names import group_label, known_tags, tag_numbers
from fenics_bridge.types import Law, OfPosition


class FemSite:
    """A body of finite elements that is built and excavated in stages, see `Stage` and `carry_out`. Collective.

    Args:
        fem: finite elements, new and unloaded, of the soils of all stages, with a law for each or one for all, which is then the
            law of each; at first none is placed.
        first_step: first fraction of each stage's change [-], as for `QuasiStatic.solve`.
        tolerance: fraction of a stage's change below which steps end [-].
        progress: function that is called with each load step, e.g. `print_step`.

    Raises:
        InputError: fem has no cell tags, is loaded already, or has a support that prescribes a displacement, which belongs in a
            stage. Raised on all ranks alike.
    """

    def __init__(
        self,
        fem: QuasiStatic,
        first_step: float | None = None,
        tolerance: float = 1e-3,
        progress: Callable[[LoadStep], Any] | None = None,
    ) -> None:
        comm = fem.domain.comm
        agree(
            comm,
            None if fem.cell_tags is not None else "fem has no cell_tags, expected those of the soils that stages name",
        )
        fresh = fem.load == Load() and not fem.off
        agree(comm, None if fresh else "fem is loaded already, expected a new one, whose soils the stages place")
        moved = next((support for support in fem.supports if any(support.displacement or ())), None)
        problem = (
            f"supports: {moved} prescribes a displacement, expected it in a stage, which applies it: Stage(support=...)"
        )
        agree(comm, problem if moved else None)
        self.fem = fem
        """The finite elements"""
        self.number = 0
        """Number of the last stage, from 1 on; 0 before the first one"""
        self._options: dict[str, Any] = {"first_step": first_step, "tolerance": tolerance, "progress": progress}
        self.state = SiteState(
            comm,
            lambda given, argument: tag_numbers(comm, fem.cell_tags, given, argument, "cell"),
            lambda given, argument: tag_numbers(comm, fem.facet_tags, given, argument),
            name_of=lambda tag: group_label(fem.cell_tags, tag),
            supports=fem.supports,
            require_members=self._require_members,
        )
        """Which soils have been placed, their weights, loads and supports"""
        self._every = set(known_tags(comm, fem.cell_tags))
        fem.give_laws_by_tag()
        switch_off(fem)

    def __repr__(self) -> str:
        return f"<FemSite: after stage {self.number}; {self.fem!r}>"

    def carry_out(self, stage: Stage) -> StageReport:
        """Bring the body to equilibrium after a stage's changes. Collective.

        Args:
            stage: the changes.

        Returns:
            Report of the stage.

        Raises:
            InputError: the stage has an unknown soil or boundary, and nothing has been changed; or it presses a boundary inside of
                the soil. Raised on all ranks alike.
            StageError: there is no equilibrium.
        """
        fem = self.fem
        state, _, _ = self.state.after(stage)
        ratios = state.overconsolidation_of(stage, self._laws(state))
        load = self._begin(stage, state, ratios)
        steps = fem.solve(reached_by(stage, fem.load, load, state), **self._options)
        self.number += 1
        if not fem.converged:
            raise StageError(self._failure(stage, steps), 1.0 - fem.load.held)
        self._harden(ratios, fem.law_by_tag())
        if self.number == 1:
            self._rest()
        iterations = sum(step.report.iterations for step in steps)
        return StageReport(self.number, stage.name, len(steps), iterations, self.largest_displacement())

    def place(self, stages: Iterable[Stage]) -> Load:
        """Bring the soils, laws, supports and water after some stages at once, without the stresses of the stages. Collective.

        It is for the factor of safety, which hardly depends on the stresses before failure, also of ground that does not carry its
        weight and in which therefore no stage has an equilibrium. Soil with friction that does not drain (`mpm.Undrained`) has the
        strength of its effective stress, and needs `carry_out`. The stages before the last one that has a `strength_ratio` are carried out,
        since their stresses give that strength.

        Args:
            stages: the stages from the beginning on; at least one.

        Returns:
            The load after the last one, for `factor_of_safety`. It does not act yet.

        Raises:
            InputError: there is no stage, one was carried out before, one has an unknown soil or boundary or prescribes a
                displacement, or the last one has a deconfinement below 1. Raised on all ranks alike.
            StageError: a stage before the last one with a `strength_ratio` has no equilibrium.

        Example:
            >>> site = bridge.FemSite(fem)
            >>> safety = bridge.factor_of_safety(fem, site.place(stages))
        """
        comm, stages = self.fem.domain.comm, list(stages)
        agree(comm, f"stage {self.number} has been carried out, expected a new site" if self.number else None)
        agree(comm, None if stages else "stages is empty, expected those of the site")
        require_stages(self, stages)
        require_released(
            comm, stages[-1], "it is the last one, and soil at once is held by no forces; carry_out has them"
        )
        moved = [stage.name for stage in stages if any(v for one in stage.support for v in one.displacement or ())]
        agree(comm, f"stage {moved[0]!r}: support prescribes a displacement: carry_out applies it" if moved else None)
        last = max((number for number, stage in enumerate(stages) if stage.strength_ratio), default=0)
        for stage in stages[:last]:
            self.carry_out(stage)
        state, rest, load = self.state, stages[last:], None
        if rest[0].strength_ratio:
            state, _, _ = state.after(rest[0])
            ratios = state.overconsolidation_of(rest[0], self._laws(state))
            load, rest = self._begin(rest[0], state, ratios), rest[1:]
        for stage in rest:
            state, _, _ = state.after(stage)
        self.number = len(stages)
        return self._enter(state) if rest or load is None else load

    def largest_displacement(self) -> float:
        """Largest displacement of a node of the present soil, since displacements count [m]. Collective."""
        size = np.linalg.norm(self.fem.displacement.x.array.reshape(-1, self.fem.domain.geometry.dim), axis=1)
        points, space = self.fem.points, self.fem.displacement.function_space
        there = cell_dofs(space)[points.cells[points.material >= 0]].ravel()
        return max(self.fem.domain.comm.allgather(float(size[there].max(initial=0.0))))

    def _off(self, there: Collection[int]) -> tuple[int, ...]:
        """Tags of the soils that are not there."""
        return tuple(sorted(self._every.difference(there)))

    def _require_members(self, where: str, there: Collection[int], members: dict[str, Member]) -> None:
        """Require that members are in the soils that are there. where: stage, for messages. Collective."""
        off = self._off(there)
        active = cells_there(self.fem.domain, self.fem.cell_tags, off) if off else None
        self.fem.require_members(members, active, where)

    def _begin(self, stage: Stage, state: SiteState, ratios: Mapping[int, float]) -> Load:
        """Make the changes of a stage, which leads to a state; returns the state's load, which does not act yet.

        ratios: overconsolidation ratios [-] of the stage, by tag.
        """
        fem, laws, before = self.fem, self._laws(state), self.state.there
        k0, weak = state.k0_of(stage), state.strength_ratio_of(stage, laws)
        given, carried = (
            stress_at_rest(fem, state, self._off(state.there), laws, k0, before) if k0 else (None, fem.points.stress)
        )
        strength = self._strength(weak, laws, carried)
        if stage.reset_displacement:
            fem.reset_displacement()
        if replaced := set(stage.remove).intersection(stage.install):
            fem.reconfigure(members={name: one for name, one in fem.members.items() if name not in replaced})
        stress = stage.stress if given is None else given
        load = self._enter(state, stress, strength, before_equilibrium(ratios, laws))
        if given is not None:
            rows = rows_of(fem, k0)
            warn_beyond_strength(fem.domain.comm, f"stage {stage.name!r}: ", given[rows], fem.points.stress[rows])
        return load

    def _strength(
        self, ratios: Mapping[int, StrengthRatio], laws: Mapping[int, Law], placed: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Undrained strengths (n,) [Pa] of soils with a strength ratio under their stresses, NaN elsewhere; None without any.

        Args:
            ratios: by cell tag.
            laws: by cell tag, from now on.
            placed: stresses (n, S) [Pa] with which soils are placed that were not there before.
        """
        if not ratios:
            return None
        points, before, present = self.fem.points, self.fem.law_by_tag(), self.fem._kinematics.carried_stress()
        found = np.full(points.n, np.nan)
        for tag, ratio in ratios.items():
            rows, law = rows_of(self.fem, (tag,)), before[tag]
            if tag in self.state.there:
                vertical = vertical_stress(law, present[rows], points.state[rows, : law.n_state])
            else:
                vertical = -placed[rows, upward(placed.shape[1])]
            found[rows] = strengths(laws[tag], ratio, vertical, points.coordinates()[rows])
        return found

    def _enter(
        self,
        state: SiteState,
        stress: OfPosition | NDArray[np.float64] | None = None,
        strength: NDArray[np.float64] | None = None,
        ratios: Mapping[int, float] | None = None,
    ) -> Load:
        """Change the body to a state; returns the state's load, which does not act yet.

        Args:
            state: the state.
            stress: of soils that are placed.
            strength: cohesion (n,) [Pa] of the points from now on, NaN where it stays; None where all stay.
            ratios: overconsolidation ratios [-] that soils have before they come to equilibrium, by tag.
        """
        off, parameters = self._off(state.there), {} if strength is None else {STRENGTH: strength}
        laws, members = self._laws(state), of_members(state.members)
        harden = partial(self._harden, ratios or {}, laws)
        reconfigure(self.fem, off, state.supports, state.pore_pressure, stress, laws, members, parameters, harden)
        self.state = state
        moved = any(v for s in state.supports for v in (s.displacement or ()) if v)
        return Load({tag: state.unit_weight[tag] for tag in state.there}, state.pressure, float(moved))

    def _harden(self, ratios: Mapping[int, float], laws: Mapping[int, Law]) -> None:
        """Give the points of soils the hardening of overconsolidation ratios [-] under their present stresses; ratios and laws by tag."""
        points = self.fem.points
        for tag, ratio in ratios.items():
            rows, law = rows_of(self.fem, (tag,)), laws[tag]
            states = points.state[rows, : law.n_state]
            points.state[rows, : law.n_state] = hardened(law, points.stress[rows], states, ratio)

    def _rest(self) -> None:
        """Let the ground forget the small strains of its first stage."""
        points = self.fem.points
        for tag, law in self.fem.law_by_tag().items():
            rows = rows_of(self.fem, (tag,))
            points.state[rows, : law.n_state] = without_memory(law, points.state[rows, : law.n_state])

    def _laws(self, state: SiteState) -> Any:
        """The present laws, by tag: those of the stage, otherwise those that the body had before."""
        present = self.fem.law_by_tag()
        return {tag: state.law.get(tag, law) for tag, law in present.items()}

    def _failure(self, stage: Stage, steps: list[LoadStep]) -> Any:
        fem = self.fem
        reason = next((step.report.reason for step in reversed(steps) if not step.converged), "no step was tried")
        return f"stage {self.number} ({stage.name!r}) has no equilibrium beyond {1 - fem.load.held:.3g} of its change: {reason}."
