"""Collisions of an arm with itself and its scene: clearance of motions, clearance constraints,
collision-free paths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.clearance_constraint import ClearanceConstraint
from joulepath.optimizer.collision.clearance_proof import is_proven_clear, proven_clearance
from joulepath.optimizer.collision.model import ClosestPair, CollisionModel, collision_model
from joulepath.optimizer.collision.planner.path_planner import (
    USUAL,
    Effort,
    PlannedPaths,
    PlanningEnd,
    plan_paths,
)
from joulepath.optimizer.collision.planner.state_validity import ValidityCheckers
from joulepath.optimizer.collision.stand_ins import StandIns
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import PathConstraints, path_constraint_list
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.certificate import Clearance

# samples of a motion at which distances are computed
CONTACT_SAMPLES = 96
# pairs that stay farther apart than this [m] throughout a motion get no clearance constraint
ACTIVE = 0.15
# clearance [m] beyond the margins below which an obstacle is likely to limit the optimum
NEAR_CONTACT = 5e-3


@dataclass(frozen=True)
class Surroundings:
    """The collision side of a problem's arm, shared by all candidates. If `arm.collisions` is
    false, nothing collides.

    All distances [m] have the margins of the obstacles subtracted.
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
        """What would touch in a motion, by samples, if stand-ins took the place of a tool and
        payload without shape.
        """
        if self._stand_ins is None:
            return []
        return self._stand_ins.contacts(
            np.linspace(0.0, spline.duration, CONTACT_SAMPLES), self._samples(spline)
        )

    def worst_violation(self, spline: Spline) -> Clearance | None:
        """Clearance of a motion whose margins are violated or not proven: distance, pair and time.

        None if the margins are proven, or if collisions are not checked.
        """
        if not self.arm.collisions:
            return None
        if is_proven_clear(self.model, spline):
            return None
        distance = self.model.along(self._samples(spline), 0.0)
        least = float(distance.min(initial=np.inf))
        if least < 0:
            k, pair = np.unravel_index(int(distance.argmin()), distance.shape)
            time = spline.duration * float(k) / (CONTACT_SAMPLES - 1)
            return Clearance(least, least, self.model.names(int(pair)), time)
        found = proven_clearance(self.model, spline)
        return found if found is not None and found.min_clearance < 0 else None

    def is_collision_free(self, q: Array) -> bool:
        """Whether samples q (k, nq) [rad] of a motion keep all margins. About CONTACT_SAMPLES of
        them are checked.
        """
        if not self.arm.collisions:
            return True
        return self._least_distance(q, 0.0) >= 0

    def worst_collisions(self, motions: Sequence[Array]) -> list[ClosestPair | None]:
        """The pair that violates its margin most over the samples q (k, nq) [rad] of each motion;
        None if none does.

        About CONTACT_SAMPLES of the samples are checked, those of motions along the same path once.
        """
        if not self.arm.collisions or not len(self.model.pairs):
            return [None] * len(motions)
        paths = {id(q): _thinned(q) for q in motions}
        distance = self.model.along(np.concatenate(list(paths.values())), within=0.0)
        parts = np.split(distance, np.cumsum([len(q) for q in paths.values()])[:-1])
        found = {key: self._worst(part) for key, part in zip(paths, parts, strict=True)}
        return [found[id(q)] for q in motions]

    def _worst(self, distance: Array) -> ClosestPair | None:
        """The pair of the least of the distances (k, pairs) [m]; None if none is negative."""
        sample, pair = np.unravel_index(int(distance.argmin()), distance.shape)
        least = float(distance[sample, pair])
        return ClosestPair(self.model.names(int(pair)), least) if least < 0 else None

    def is_near_contact(self, q: Array) -> bool:
        """Whether any of q (k, nq) [rad] has a clearance below NEAR_CONTACT.

        An obstacle is then likely to limit the optimum. About CONTACT_SAMPLES of them are checked.
        """
        return self.arm.collisions and self._least_distance(q, NEAR_CONTACT) < NEAR_CONTACT

    def active_pairs(self, spline: Spline) -> Indices:
        """Indices (k,) of the pairs that need a clearance constraint: closer than ACTIVE at a
        sample of the motion.
        """
        return np.flatnonzero(
            self.model.pairs_within(self.model.frames(self._samples(spline)), ACTIVE)
        )

    def with_clearance(self, pairs: Indices) -> PathConstraints:
        """The path constraints of the arm, and the clearance of `pairs` (k,) of the collision
        model.
        """
        constraints = [*path_constraint_list(self.arm), ClearanceConstraint(self.model, pairs)]
        return PathConstraints(joint_placements(self.arm.robot.model), constraints)

    def planned_paths(
        self,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        other_goals: Sequence[Array] = (),
        effort: Effort = USUAL,
    ) -> PlannedPaths:
        """Collision-free joint paths from q_start to q_goal or one of the others, (nq,) [rad]; see
        `plan_paths`.

        Paths found are kept: a later call for the goal that they lead to returns them, and the
        first one for a goal that differs by full turns follows the shortest of them. A planning
        without a path is kept, for all goals that differ by full turns, only until more states are
        allowed, and not at all if the deadline ended it.
        """
        known, turned = (
            self._planned.get(_key(q_start, q_goal)),
            self._turned.get(_turned_key(q_start, q_goal)),
        )
        for earlier in (known, turned if turned is not None and not turned.paths else None):
            if earlier is not None and (
                earlier.paths or earlier.checked_states >= effort.most_states
            ):
                return earlier
        like = turned.paths[0] if known is None and turned is not None and turned.paths else None
        goals = q_goal[None] if like is not None else np.vstack([q_goal, *other_goals])
        planned = plan_paths(
            self.arm, q_start, goals, deadline, effort, checkers=self._checkers, like=like
        )
        for goal in {path[-1].tobytes(): path[-1] for path in planned.paths}.values():
            self._keep(q_start, goal, replace(planned, paths=planned.leading_to(goal)))
        if planned.end is PlanningEnd.EXHAUSTED:
            for goal in goals:
                self._keep(q_start, goal, planned)
        return planned

    def _keep(self, q_start: Array, q_goal: Array, planned: PlannedPaths) -> None:
        self._planned[_key(q_start, q_goal)] = planned
        turned = self._turned.get(_turned_key(q_start, q_goal))
        if turned is None or not turned.paths:
            self._turned[_turned_key(q_start, q_goal)] = planned

    def has_planned_paths(self, q_start: Array, q_goal: Array) -> bool:
        """Whether paths from q_start to q_goal (nq,) have been planned and found."""
        known = self._planned.get(_key(q_start, q_goal))
        return known is not None and bool(known.paths)

    def seems_enclosed(self, q_start: Array, q_goal: Array) -> bool:
        """Whether plannings to q_goal (nq,) [rad], and to what differs from it by full turns, have
        found no path.
        """
        known = self._turned.get(_turned_key(q_start, q_goal))
        return known is not None and not known.paths

    @cached_property
    def _checkers(self) -> ValidityCheckers:
        return ValidityCheckers(self.arm, self.model)

    @cached_property
    def _planned(self) -> dict[bytes, PlannedPaths]:
        return {}

    @cached_property
    def _turned(self) -> dict[bytes, PlannedPaths]:
        """The first paths that were found, else the last planning, for all goals that differ by
        full turns.
        """
        return {}

    def _least_distance(self, q: Array, within: float) -> float:
        """The least signed distance [m] over some of the samples q (k, nq) of a motion; if above
        `within` [m], a lower bound above it."""
        return float(self.model.along(_thinned(q), within).min(initial=np.inf))

    def _samples(self, spline: Spline) -> Array:
        """Samples q (CONTACT_SAMPLES, nq) [rad] at equal steps of a motion."""
        return np.asarray(spline.curve(np.linspace(0.0, spline.duration, CONTACT_SAMPLES)))


def _thinned(q: Array) -> Array:
    """About CONTACT_SAMPLES of the samples q (k, nq)."""
    return q[:: max(len(q) // CONTACT_SAMPLES, 1)]


def _key(q_start: Array, q_goal: Array) -> bytes:
    return q_start.tobytes() + q_goal.tobytes()


def _turned_key(q_start: Array, q_goal: Array) -> bytes:
    """The same for all goals that differ by full turns."""
    return q_start.tobytes() + (np.round([np.cos(q_goal), np.sin(q_goal)], 6) + 0.0).tobytes()
