"""A problem with its models, ready to compute with: torques, energy and constraints of its
motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import ClosestPair
from joulepath.optimizer.dynamics.dwell import dwell_energy, holding_power, waits
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import waiting_sensitivity
from joulepath.optimizer.kinematics.path_constraints import PathConstraints, path_constraints_of
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace, traces
from joulepath.optimizer.kinematics.tool_path.joint_path import joint_path
from joulepath.optimizer.kinematics.tool_path.least_speed import LeastSpeed
from joulepath.optimizer.kinematics.tool_path.least_time import least_time
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.limit_ratios import too_much
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.result.energy import Energy, Sensitivity
from joulepath.optimizer.surroundings import Surroundings

# value of a second in a minimum-time solve [W]: a hundred times what energy could make up for
TIME_WEIGHT = 1e4
# rounding of a constraint ratio
RATIO_ROUNDING = 1e-6
# what is built for an arm, whatever the problem
_OF_THE_ARM = frozenset(
    ("kernel", "model", "_data", "electrical_parameters", "surroundings", "path")
)


@dataclass(frozen=True)
class PreparedProblem(Plant):
    """A problem with everything that its candidates share: kernel, rigid-body model, path
    constraints, surroundings.
    """

    problem: Problem

    @classmethod
    def of(cls, problem: Problem) -> PreparedProblem:
        """The problem with its models. They are built when they are first used."""
        return cls(problem.arm, problem)

    def sharing(self, problem: Problem) -> PreparedProblem:
        """Another problem of the same arm, with those models of the arm that are built."""
        assert problem.arm is self.arm
        other = PreparedProblem.of(problem)
        vars(other).update(
            {name: value for name, value in vars(self).items() if name in _OF_THE_ARM}
        )
        return other

    @cached_property
    def surroundings(self) -> Surroundings:
        """Collisions of the arm with itself and the scene."""
        return Surroundings(self.arm)

    @cached_property
    def path(self) -> PathConstraints | None:
        """Constraints along the path except clearance; None if there are none."""
        return path_constraints_of(self.arm)

    @cached_property
    def course(self) -> ToolCourse | None:
        """The course of the problem's tool path; None if there is none."""
        path, start, goal = self.problem.tool_path, self.problem.start, self.problem.goal
        if path is None:
            return None
        return ToolCourse.of(path, self._pose(start), self._pose(goal))

    def _pose(self, end: Target) -> Array | ConeOrientedPose:
        """T_base_tcp (4, 4) at an end that is a pose or joint positions; the end itself if a
        rotation is free there.
        """
        if isinstance(end, ConeOrientedPose):
            return end
        return end.T if isinstance(end, Pose) else tcp_pose(self.arm, np.asarray(end))

    @cached_property
    def least_speed(self) -> LeastSpeed | None:
        """The least speed on the tool path; None if there is none."""
        return None if self.course is None else LeastSpeed.of(self.arm, self.course)

    @cached_property
    def least_time(self) -> float:
        """Least duration [s] that the tool path leaves to a motion; zero without one."""
        return 0.0 if self.course is None else least_time(self.arm, self.course)

    def freed(self, start: Target | None = None, goal: Target | None = None) -> Problem:
        """The problem without its tool path, of motions that last as long as those along it: their
        bounds hold for these.

        It is between `start` and `goal`, or the problem's own ends. Only along a path may a start
        leave its orientation free: such a problem needs another start.
        """
        problem, least = self.problem, self.least_time
        shortest = min(max(problem.duration_min or 0.0, least), problem.duration_max or np.inf)
        return replace(
            problem,
            tool_path=None,
            duration_min=shortest if shortest > 0 else problem.duration_min,
            start=problem.start if start is None else start,
            goal=problem.goal if goal is None else goal,
        )

    @cached_property
    def traces(self) -> dict[bytes, Trace]:
        """The tool path as it was followed from starts q (nq,) [rad], by the bytes of these."""
        return {}

    @cached_property
    def even_motions(self) -> dict[tuple[bytes, float, float], tuple[Spline | None, bool]]:
        """Motions at the tool path's fixed speed, and whether they are within the limits, by the
        joints' path and the times [s] of both ramps."""
        return {}

    @cached_property
    def _joint_paths(self) -> dict[bytes, Spline | None]:
        return {}

    def joint_path(self, q_start: Array) -> Spline | None:
        """The joints' path over [0, 1] along the tool path, from q_start (nq,) [rad]; None if they
        cannot follow it.
        """
        assert self.course is not None
        key = q_start.tobytes()
        if key not in self._joint_paths:
            if key not in self.traces:
                (self.traces[key],) = traces(self.arm, self.course, q_start[None])
            trace = self.traces[key]
            self._joint_paths[key] = (
                joint_path(self.arm, self.course, trace) if trace.obstacle is None else None
            )
        return self._joint_paths[key]

    @cached_property
    def _chosen(self) -> set[bytes]:
        return set()

    def is_chosen(self, q_start: Array) -> bool:
        """Whether other turnings of the tool have been looked for from q_start (nq,) [rad] on."""
        return q_start.tobytes() in self._chosen

    def choose(
        self, q_start: Array, trace: Trace | None = None, path: Spline | None = None
    ) -> None:
        """Note that turnings have been looked for from q_start (nq,) [rad] on; the joints follow
        that of a trace, by `path`, from now on."""
        key = q_start.tobytes()
        self._chosen.add(key)
        if trace is not None:
            self.traces[key], self._joint_paths[key] = trace, path

    def broken_on_the_way(self, q: Sequence[Array], v: Sequence[Array]) -> list[list[str]]:
        """What samples q [rad], v [rad/s] (k, nq) of each motion break, in words: path constraints,
        a margin.
        """
        collisions = self.surroundings.worst_collisions(q)
        return [self._broken(*each) for each in zip(q, v, collisions, strict=True)]

    def _broken(self, q: Array, v: Array, collision: ClosestPair | None) -> list[str]:
        broken = []
        if self.path is not None:
            worst = self.path.ratios(q, v).max(axis=0)
            ratios = dict(
                sorted(zip(self.path.names, worst, strict=True), key=lambda each: each[1])
            )
            broken = [
                too_much(name, ratio)
                for name, ratio in ratios.items()
                if ratio > 1 + RATIO_ROUNDING
            ]
        slowest = np.inf if self.least_speed is None else self.least_speed.reached(q, v)
        if slowest < 1 - RATIO_ROUNDING:
            broken.append(f"path speed {(1 - slowest) * 100:.3g} % below its least one")
        if collision is not None:
            first, second = collision.pair
            broken.append(
                f"{first} and {second} are {-collision.distance * 1e3:.3g} mm closer than allowed"
            )
        return broken

    def holding_power(self, q: Array) -> Array:
        """Power drawn (...) [W] while the motors hold the arm at standstill at q (..., nq)
        [rad]."""
        configurations = q.reshape(-1, q.shape[-1])
        standstill = np.zeros_like(configurations)
        return holding_power(
            self.arm, self.torques(configurations, standstill, standstill)
        ).reshape(q.shape[:-1])

    def energy(self, spline: Spline) -> Energy:
        """Energy of a motion and of waiting after it, exact except for quadrature."""
        energy, dwell = super().energy(spline), self.problem.dwell
        if dwell is None:
            return energy
        hold = float(self.holding_power(spline.control_points[-1]))
        return energy.with_dwell(dwell_energy(dwell, self.arm, hold, spline.duration))

    def sensitivity(self, spline: Spline) -> Sensitivity:
        """How the electrical energy of a motion, and of waiting after it, hangs on the arm's
        figures.
        """
        moving, dwell = super().sensitivity(spline), self.problem.dwell
        if dwell is None:
            return moving
        still = np.zeros((1, self.arm.robot.nq))
        q_end = spline.control_points[-1]
        held = self.torques(q_end[None], still, still)[0]
        times = waits(dwell, spline.duration)
        return moving + waiting_sensitivity(
            self.arm, q_end, held, *times, dwell, arm_spread(self.arm)
        )

    @cached_property
    def objective_parameters(self) -> Array:
        """Kernel parameters of the problem's objective."""
        return self.parameters(**{self.problem.objective: 1.0})

    @cached_property
    def fastest_parameters(self) -> Array:
        """Kernel parameters that minimise the duration; a little energy beside it conditions the
        NLP.
        """
        return self.parameters(electrical=1.0, time=TIME_WEIGHT)

    def objective_of(self, energy: Energy) -> float:
        """The part of an energy that is minimised [J]."""
        return energy.of(self.problem.objective)

    def cost_of(self, spline: Spline | None) -> float:
        """The part of a motion's energy that is minimised [J]; infinite if there is no motion."""
        return np.inf if spline is None else self.objective_of(self.energy(spline))
