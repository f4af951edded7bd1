"""A problem with its models: torques, energy and constraints of its motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import ClosestPair
from joulepath.optimizer.dynamics.dwell import holding_times, with_dwell
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import waiting_sensitivity
from joulepath.optimizer.kinematics.path_constraints import PathConstraints, path_constraints_of
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tool_path.followed_paths import FollowedPaths
from joulepath.optimizer.kinematics.tool_path.least_speed import LeastSpeed
from joulepath.optimizer.kinematics.tool_path.least_time import least_time
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.limit_ratios import excess_text
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.result.energy import Energy, Sensitivity
from joulepath.optimizer.surroundings import Surroundings


@dataclass(frozen=True)
class PreparedProblemSettings:
    """Settings of a prepared problem."""

    time_weight: float = 1e4
    """Value of a second in a minimum-time solve [W]: 100 times what energy could make up for."""
    ratio_rounding: float = 1e-6
    """Rounding error of a constraint ratio [1]."""


PREPARED = PreparedProblemSettings()


@dataclass(frozen=True)
class ArmModels(Plant):
    """Models of an arm. They are built at their first use and shared by all problems of the arm."""

    @cached_property
    def surroundings(self) -> Surroundings:
        """Collisions of the arm with itself and the scene."""
        return Surroundings(self.arm)

    @cached_property
    def path(self) -> PathConstraints | None:
        """Path constraints except clearance; None if there are none."""
        return path_constraints_of(self.arm)


class ModelsOfArms:
    """Models of several arms, such as the arms of a cycle with and without its payload.

    Arms are distinguished by identity.
    """

    def __init__(self) -> None:
        self._known = list[ArmModels]()

    def of(self, arm: Arm) -> ArmModels:
        """Models of an arm, shared by all problems of this arm."""
        for models in self._known:
            if models.arm is arm:
                return models
        self._known.append(ArmModels(arm))
        return self._known[-1]

    def prepared(self, problem: Problem) -> PreparedProblem:
        """The problem with the models of its arm."""
        return PreparedProblem.of(problem, self.of(problem.arm))


@dataclass(frozen=True)
class PreparedProblem(Plant):
    """A problem with the models that all its candidates share."""

    problem: Problem
    models: ArmModels

    @classmethod
    def of(cls, problem: Problem, models: ArmModels | None = None) -> PreparedProblem:
        """The problem with models of its arm.

        Args:
            problem: problem to prepare.
            models: models of the same arm, to be shared; None for new ones.
        """
        assert models is None or models.arm is problem.arm
        return cls(problem.arm, problem, ArmModels(problem.arm) if models is None else models)

    def beside(self, problem: Problem) -> PreparedProblem:
        """Another problem of the same arm, with the same models."""
        return PreparedProblem.of(problem, self.models)

    @cached_property
    def kernel(self) -> Kernel:
        """Compiled functions of the robot."""
        return self.models.kernel

    @cached_property
    def model(self) -> pin.Model:
        """Pinocchio model of the arm, payload and gravity included."""
        return self.models.model

    @cached_property
    def _data(self) -> pin.Data:
        return self.models._data

    @cached_property
    def electrical_parameters(self) -> Array:
        """Kernel parameters of the electrical energy as the cost."""
        return self.models.electrical_parameters

    @property
    def surroundings(self) -> Surroundings:
        """Collisions of the arm with itself and the scene."""
        return self.models.surroundings

    @property
    def path(self) -> PathConstraints | None:
        """Path constraints except clearance; None if there are none."""
        return self.models.path

    @cached_property
    def course(self) -> ToolCourse | None:
        """Course of the TCP along the problem's tool path; None without one."""
        path, start, goal = self.problem.tool_path, self.problem.start, self.problem.goal
        if path is None:
            return None
        return ToolCourse.of(path, self._pose(start), self._pose(goal))

    def _pose(self, end: Target) -> Array | ConeOrientedPose:
        """T_base_tcp (4, 4) at an end; the end itself if it leaves a rotation free."""
        if isinstance(end, ConeOrientedPose):
            return end
        return end.T if isinstance(end, Pose) else tcp_pose(self.arm, np.asarray(end))

    @cached_property
    def followed(self) -> FollowedPaths:
        """Memo of the tool path as the arm follows it; only for a problem with a tool path."""
        assert self.course is not None
        return FollowedPaths(self.arm, self.course)

    @cached_property
    def least_speed(self) -> LeastSpeed | None:
        """Least speed on the tool path; None without one."""
        return None if self.course is None else LeastSpeed.of(self.arm, self.course)

    @cached_property
    def least_time(self) -> float:
        """Least duration of a motion along the tool path [s]; zero without one."""
        return 0.0 if self.course is None else least_time(self.arm, self.course)

    def freed(self, start: Target | None = None, goal: Target | None = None) -> Problem:
        """The problem without its tool path, for motions of at least the path's duration.

        Every motion along the tool path is a motion of this problem, so lower bounds of this
        problem hold along the path.

        Args:
            start: start of the problem; None for its own start. Only along a path may a start leave
                its orientation free, so such a problem needs another start.
            goal: goal of the problem; None for its own goal.
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

    def broken_on_the_way(
        self, q: Sequence[Array], v: Sequence[Array], paths: Sequence[Array]
    ) -> list[list[str]]:
        """Violated path constraints and margins of several motions, in words.

        Args:
            q: positions of every motion, shape (k, nq) [rad].
            v: velocities of every motion, shape (k, nq) [rad/s].
            paths: samples of its path that are checked for collisions, shape (m, nq) [rad].
        """
        collisions = self.surroundings.worst_collisions(paths)
        return [self._broken(*sampled) for sampled in zip(q, v, collisions, strict=True)]

    def _broken(self, q: Array, v: Array, collision: ClosestPair | None) -> list[str]:
        broken, rounding = [], PREPARED.ratio_rounding
        if self.path is not None:
            worst = self.path.ratios(q, v).max(axis=0)
            ratios = dict(
                sorted(zip(self.path.names, worst, strict=True), key=lambda each: each[1])
            )
            broken = [
                excess_text(name, ratio) for name, ratio in ratios.items() if ratio > 1 + rounding
            ]
        slowest = np.inf if self.least_speed is None else self.least_speed.reached(q, v)
        if slowest < 1 - rounding:
            broken.append(f"path speed {(1 - slowest) * 100:.3g} % below its minimum")
        if collision is not None:
            first, second = collision.pair
            broken.append(
                f"{first} and {second} are {-collision.distance * 1e3:.3g} mm closer than allowed"
            )
        return broken

    def energy(self, spline: Spline) -> Energy:
        """Energy of a motion and of the dwell after it, exact except for quadrature."""
        energy, dwell = super().energy(spline), self.problem.dwell
        if dwell is None:
            return energy
        hold = float(self.holding_power(spline.control_points[-1]))
        return with_dwell(energy, dwell, self.arm, hold, spline.duration)

    def sensitivity(self, spline: Spline) -> Sensitivity:
        """Sensitivity of the electrical energy of a motion and its dwell to the arm's figures."""
        moving, dwell = super().sensitivity(spline), self.problem.dwell
        if dwell is None:
            return moving
        q_end = spline.control_points[-1]
        held = self.holding_torques(q_end[None])[0]
        times = holding_times(dwell, spline.duration)
        return moving + waiting_sensitivity(
            self.arm, q_end, held, *times, dwell, arm_spread(self.arm)
        )

    @cached_property
    def objective_parameters(self) -> Array:
        """Kernel parameters of the problem's objective."""
        return self.parameters(**{self.problem.objective: 1.0})

    @cached_property
    def fastest_parameters(self) -> Array:
        """Kernel parameters of the duration as objective; a little energy conditions the NLP."""
        return self.parameters(electrical=1.0, time=PREPARED.time_weight)

    def objective_of(self, energy: Energy) -> float:
        """Part of an energy that the problem minimises [J]."""
        return energy.of(self.problem.objective)

    def cost_of(self, spline: Spline | None) -> float:
        """Objective of a motion [J]; infinite without a motion."""
        return np.inf if spline is None else self.objective_of(self.energy(spline))
