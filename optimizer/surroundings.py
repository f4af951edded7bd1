"""Collisions of an arm with itself and its scene: clearances, constraints and planned paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.clearance_constraint import ClearanceConstraint
from joulepath.optimizer.collision.clearance_proof import is_proven_clear, proven_clearance
from joulepath.optimizer.collision.model import ClosestPair, CollisionModel, collision_model
from joulepath.optimizer.collision.planner.path_planner import USUAL_EFFORT, Effort, plan_paths
from joulepath.optimizer.collision.planner.planned_path_memo import PlannedPathMemo
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths
from joulepath.optimizer.collision.planner.state_validity import ValidityCheckers
from joulepath.optimizer.collision.stand_ins import StandIns
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import PathConstraints, path_constraint_list
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.certificate import Clearance


@dataclass(frozen=True)
class ContactSettings:
    """Settings of the sampled collision checks."""

    samples: int = 96
    """Samples of a motion at which distances are computed."""
    active_distance: float = 0.15
    """Distance above which a pair of bodies gets no clearance constraint [m]."""
    near_contact: float = 5e-3
    """Clearance beyond the margins below which an obstacle is likely to limit the optimum [m]."""


CONTACT = ContactSettings()


@dataclass(frozen=True)
class Surroundings:
    """Collision models of an arm, shared by all problems of this arm.

    All distances [m] have the margins of the obstacles subtracted. If `arm.collisions` is false,
    nothing collides.
    """

    arm: Arm

    @cached_property
    def model(self) -> CollisionModel:
        """Bodies, checked pairs and distances."""
        return collision_model(self.arm)

    @cached_property
    def _stand_ins(self) -> StandIns | None:
        return StandIns.of(self.arm)

    def unmodelled_contacts(self, spline: Spline) -> list[Clearance]:
        """Sampled contacts of bodies that stand in for a tool or payload without a shape."""
        if self._stand_ins is None:
            return []
        return self._stand_ins.contacts(
            np.linspace(0.0, spline.duration, CONTACT.samples), self._samples(spline)
        )

    def worst_violation(self, spline: Spline) -> Clearance | None:
        """Clearance of a motion whose margins are violated or not proven.

        Returns:
            The distance, pair of bodies and time; None if the margins are proven, or if collisions
            are not checked.
        """
        if not self.arm.collisions:
            return None
        if is_proven_clear(self.model, spline):
            return None
        distance = self.model.distances_along(self._samples(spline), 0.0)
        least = float(distance.min(initial=np.inf))
        if least < 0:
            k, pair = np.unravel_index(int(distance.argmin()), distance.shape)
            time = spline.duration * float(k) / (CONTACT.samples - 1)
            return Clearance(least, least, self.model.names(int(pair)), time)
        found = proven_clearance(self.model, spline)
        return found if found is not None and found.min_clearance < 0 else None

    def is_collision_free(self, q: Array) -> bool:
        """Whether the samples q (k, nq) [rad] of a motion keep all margins.

        About `CONTACT.samples` of the samples are checked.
        """
        if not self.arm.collisions:
            return True
        return self._least_distance(q, 0.0) >= 0

    def worst_collisions(self, motions: Sequence[Array]) -> list[ClosestPair | None]:
        """Most violated pair of bodies of several motions.

        About `CONTACT.samples` of the samples are checked. Motions through the same samples are
        checked once.

        Args:
            motions: samples q of every motion, shape (k, nq) [rad].

        Returns:
            The pair for every motion; None if all margins are kept.
        """
        if not self.arm.collisions or not len(self.model.pairs):
            return [None] * len(motions)
        keys = [q.tobytes() for q in motions]
        paths = {key: _thinned(q) for key, q in zip(keys, motions, strict=True)}
        distance = self.model.distances_along(np.concatenate(list(paths.values())), within=0.0)
        parts = np.split(distance, np.cumsum([len(q) for q in paths.values()])[:-1])
        found = {key: self._worst(part) for key, part in zip(paths, parts, strict=True)}
        return [found[key] for key in keys]

    def _worst(self, distance: Array) -> ClosestPair | None:
        """Pair with the least of the distances (k, pairs) [m]; None if none is negative."""
        sample, pair = np.unravel_index(int(distance.argmin()), distance.shape)
        least = float(distance[sample, pair])
        return ClosestPair(self.model.names(int(pair)), least) if least < 0 else None

    def is_near_contact(self, q: Array) -> bool:
        """Whether any sample q (k, nq) [rad] has a clearance below `CONTACT.near_contact`.

        An obstacle is then likely to limit the optimum. About `CONTACT.samples` of the samples are
        checked.
        """
        near = CONTACT.near_contact
        return self.arm.collisions and self._least_distance(q, near) < near

    def active_pairs(self, spline: Spline) -> Indices:
        """Indices (k,) of the pairs closer than `CONTACT.active_distance` at a sample of a motion.

        Only these pairs need a clearance constraint.
        """
        return np.flatnonzero(
            self.model.pairs_within(
                self.model.frames(self._samples(spline)), CONTACT.active_distance
            )
        )

    def with_clearance(self, pairs: Indices) -> PathConstraints:
        """Path constraints of the arm, with the clearance of `pairs` (k,) of the model."""
        constraints = [*path_constraint_list(self.arm), ClearanceConstraint(self.model, pairs)]
        robot = self.arm.robot
        return PathConstraints(joint_placements(robot.model), constraints, robot.coupling)

    def planned_paths(
        self,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        other_goals: Sequence[Array] = (),
        effort: Effort = USUAL_EFFORT,
    ) -> PlannedPaths:
        """Collision-free joint paths to a goal or to one of several others; see `plan_paths`.

        Results are kept in a `PlannedPathMemo`. The first planning for a goal that differs from a
        reached one by full turns follows the shortest known path.

        Args:
            q_start: joint positions at the start, shape (nq,) [rad].
            q_goal: joint positions at the goal, shape (nq,) [rad].
            deadline: end of the planning.
            other_goals: further goals, shape (nq,) [rad].
            effort: most states to be checked.
        """
        known = self._memo.recall(q_start, q_goal, effort.most_states)
        if known is not None:
            return known
        template = self._memo.template(q_start, q_goal)
        goals = np.vstack([q_goal, *other_goals]) if template is None else q_goal[None]
        planned = plan_paths(
            self.arm, q_start, goals, deadline, effort, checkers=self._checkers, template=template
        )
        self._memo.keep(q_start, goals, planned)
        return planned

    def has_planned_paths(self, q_start: Array, q_goal: Array) -> bool:
        """Whether a planning found a path from q_start to q_goal (nq,) [rad]."""
        return self._memo.has_paths(q_start, q_goal)

    def seems_enclosed(self, q_start: Array, q_goal: Array) -> bool:
        """Whether plannings to q_goal (nq,) [rad], up to full turns, found no path."""
        return self._memo.has_failed(q_start, q_goal)

    @cached_property
    def _checkers(self) -> ValidityCheckers:
        return ValidityCheckers(self.arm, self.model)

    @cached_property
    def _memo(self) -> PlannedPathMemo:
        return PlannedPathMemo()

    def _least_distance(self, q: Array, within: float) -> float:
        """Least signed distance [m] over the thinned samples q (k, nq) of a motion.

        Above `within` [m], the value is a lower bound greater than `within`.
        """
        return float(self.model.distances_along(_thinned(q), within).min(initial=np.inf))

    def _samples(self, spline: Spline) -> Array:
        """Samples q (CONTACT.samples, nq) [rad] at equal time steps of a motion."""
        return np.asarray(spline.curve(np.linspace(0.0, spline.duration, CONTACT.samples)))


def _thinned(q: Array) -> Array:
    """About CONTACT.samples of the samples q (k, nq)."""
    return q[:: max(len(q) // CONTACT.samples, 1)]
