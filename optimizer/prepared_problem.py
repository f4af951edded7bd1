"""A problem made ready to compute with, and what a spline motion does in it: samples, torques, energy, limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.collision.bodies import Indices
from optimizer.collision.clearance_proof import clearance
from optimizer.collision.model import CollisionModel, collision_model
from optimizer.collision.path_planner import plan_paths
from optimizer.deadline import Deadline
from optimizer.energy.dwell import dwell_energy, holding_power
from optimizer.energy.plant import Plant
from optimizer.kinematics.forward import joint_placements
from optimizer.kinematics.path_constraints import PathConstraints, path_constraint_list, path_constraints_of
from optimizer.nlp.clearance_constraint import ClearanceConstraint
from optimizer.problem.problem import Problem
from optimizer.solution import Clearance, Energy
from optimizer.trajectories.spline import Spline, sample

# what a second costs where the shortest duration is looked for [W]: a hundred times what energy could make up for
TIME_WEIGHT = 1e4
# samples at which contact is looked for, and a distance [m] there that leaves no doubt until the certificate
CONTACT_SAMPLES, CLEAR = 96, 0.02
# pairs further apart than that [m] are left out of the programme until a motion brings them nearer
WATCHED = 0.15
# nearer to something than this beyond the margins [m], a motion is taken to be held off by it
NEAR_CONTACT = 5e-3
# rounding of a share of a limit
SHARE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class PreparedProblem(Plant):
    """A problem ready to be worked on: shared by all candidates of one request."""

    problem: Problem

    @classmethod
    def of(cls, problem: Problem) -> PreparedProblem:
        """The problem, ready to be worked on."""
        return cls(problem.arm, problem)

    def holding_power(self, q: Array) -> Array:
        """What the arm draws (...) [W] while its motors hold it still at q (..., nq)."""
        at = q.reshape(-1, q.shape[-1])
        still = np.zeros_like(at)
        return holding_power(self.arm, self.torques(at, still, still)).reshape(q.shape[:-1])

    def energy(self, spline: Spline) -> Energy:
        """Energy of a spline motion and of waiting after it, exact but for quadrature."""
        energy, cycle = super().energy(spline), self.problem.cycle
        if cycle is None:
            return energy
        hold = float(self.holding_power(spline.control_points[-1]))
        return energy.with_dwell(dwell_energy(cycle, self.arm, hold, spline.duration))

    @cached_property
    def objective_parameters(self) -> Array:
        """Parameters of the problem's objective."""
        return self.parameters(**{self.problem.objective: 1.0})

    @cached_property
    def path(self) -> PathConstraints | None:
        """Limits along the path but for clearance, None where there are none."""
        return path_constraints_of(self.arm)

    def with_clearance(self, pairs: Indices) -> PathConstraints:
        """Limits along the path, clearance of these pairs of the collision model too."""
        return PathConstraints(
            self._placements, [*path_constraint_list(self.arm), ClearanceConstraint(self.collisions, pairs)]
        )

    def active_pairs(self, spline: Spline) -> Indices:
        """The pairs that come so near each other in a motion that they are worth watching."""
        return np.flatnonzero(self._pair_distances(spline, WATCHED).min(axis=0) < WATCHED)

    def _pair_distances(self, spline: Spline, within: float) -> Array:
        """Distances (CONTACT_SAMPLES, pairs) [m] along a motion, exact up to `within`."""
        q = sample(spline, np.linspace(0.0, spline.duration, CONTACT_SAMPLES))[0]
        return self.collisions.pair_distances(self.collisions.frames(q), within=within).distance

    @cached_property
    def collisions(self) -> CollisionModel:
        """What can hit what."""
        return collision_model(self.arm)

    @cached_property
    def _placements(self) -> Array:
        return joint_placements(self.problem.arm.robot.model)

    def planned_paths(self, q_start: Array, q_goal: Array, deadline: Deadline) -> list[Array]:
        """Joint paths from q_start to q_goal (nq,) that hit nothing, found before `deadline`; looked for once."""
        key = q_start.tobytes() + q_goal.tobytes()
        if key not in self._ways:
            self._ways[key] = plan_paths(self.arm, q_start, q_goal, deadline, model=self.collisions)
        return self._ways[key]

    def has_planned_paths(self, q_start: Array, q_goal: Array) -> bool:
        """Whether ways from q_start to q_goal have been looked for and found."""
        return bool(self._ways.get(q_start.tobytes() + q_goal.tobytes()))

    @cached_property
    def _ways(self) -> dict[bytes, list[Array]]:
        return {}

    def is_near_contact(self, q: Array) -> bool:
        """Whether q (k, nq) come so near to something that it is likely to keep them from being better."""
        return self.problem.arm.collisions and self.collisions.least(q, NEAR_CONTACT) < NEAR_CONTACT

    def worst_violation(self, spline: Spline) -> Clearance | None:
        """Where the motion comes nearest, if it is not proven to keep its margins there."""
        if not self.problem.arm.collisions:
            return None
        gaps = self._pair_distances(spline, CLEAR)
        least = float(gaps.min(initial=np.inf))
        if least >= CLEAR:
            return None
        if least < 0:
            k, pair = np.unravel_index(int(gaps.argmin()), gaps.shape)
            when = spline.duration * float(k) / (CONTACT_SAMPLES - 1)
            return Clearance(least, least, self.collisions.names(int(pair)), when)
        found = clearance(self.collisions, spline)
        return found if found is not None and found.min_clearance < 0 else None

    def satisfies_path_constraints(self, q: Array, v: Array) -> bool:
        """Whether samples q, v (k, nq) hold the limits along the path and, as far as samples tell, hit nothing."""
        if self.path is not None and (self.path.ratios(q, v) > 1 + SHARE_TOLERANCE).any():
            return False
        if not self.problem.arm.collisions:
            return True
        return self.collisions.least(q[:: max(len(q) // CONTACT_SAMPLES, 1)], 0.0) >= 0

    @cached_property
    def fastest_parameters(self) -> Array:
        """Parameters that make the duration the cost; a little energy beside it conditions the programme."""
        return self.parameters(electrical=1.0, time=TIME_WEIGHT)

    def objective_of(self, energy: Energy) -> float:
        """The part of an energy that is minimised [J]."""
        return energy.of(self.problem.objective)
