"""The layers of a cycle: the configurations in which the arm may rest at the start and at each
stop.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target, members
from joulepath.optimizer.search.end_feasibility import check_configurations, raise_if_none_is_left
from joulepath.optimizer.search.ends import ends_of

# configurations of one layer, full turns included: 64 poses of a UR arm with all of theirs
MOST_NODES = 20_000


@dataclass(frozen=True, eq=False)
class Layer:
    """Configurations `q` (n, nq) [rad] of one stop. Each is one of `ends`, `end` (n,) says which,
    and `turns` (n, nq) full turns away from this one's joint positions. `complete`: no branch of
    any pose may be missing. `some`: their poses are some of infinitely many. Where these are those
    of one pose `around`, which leaves the orientation free in part, all of its configurations
    count, known or not; of a `given` one, if the angle is given. `traces` are the ways that lead to
    the `ends`, as the arm follows them, one for each; none where no way leads there."""

    name: str
    ends: list[EndConfiguration]
    q: Array
    end: npt.NDArray[np.intp]
    turns: npt.NDArray[np.intp]
    complete: bool
    some: bool = False
    around: ConeOrientedPose | None = None
    given: Pose | None = None
    traces: tuple[Trace, ...] = ()

    @property
    def sampled(self) -> bool:
        """Whether some of them stand for infinitely many."""
        return self.some or any(end.sampled for end in self.ends)


def layer_of(
    asked: Cycle,
    place: str,
    field: str,
    target: Target,
    branch: BranchFilter | None,
    windings: bool,
) -> Layer:
    """The layer of a target, held with every arm that comes to this place or leaves it, with
    `windings` or without.

    Raises the errors of `optimize` for an end, which name `start` or `stops/NAME`; InvalidProblem,
    with `field` named, for too many configurations.
    """
    name = place if place == START else f"stops/{place}"
    problems = [
        Problem(arm=arm, start=target, goal=target, branch=branch) for arm in arms_at(asked, place)
    ]
    problem = problems[0]
    found, _ = ends_of(PreparedProblem.of(problem), name, problem.goal)
    q = np.array([end.q for end in found])
    ruled = [check_configurations(PreparedProblem.of(each), q) for each in problems]
    either = [
        next((each for each in causes if each is not None), None)
        for causes in zip(*ruled, strict=True)
    ]
    raise_if_none_is_left(name, [(end.label, end.target, end.q) for end in found], either)
    held = [end for end, cause in zip(found, either, strict=True) if cause is None]
    middle = (asked.arm.active_limits.q_min + asked.arm.active_limits.q_max) / 2
    nodes = [
        (k, np.array(node)) for k, end in enumerate(held) for node in _nodes(end, windings, middle)
    ]
    if len(nodes) > MOST_NODES:
        raise InvalidProblem(
            field,
            f"{name} has {len(nodes)} arm configurations, of at most {MOST_NODES}: give fewer "
            "targets, a `branch`, or "
            "`windings` false.",
        )
    end = np.array([k for k, _ in nodes])
    positions = np.array([node for _, node in nodes])
    turns = np.round((positions - np.array([each.q for each in held])[end]) / (2 * np.pi)).astype(
        np.intp
    )
    kinematics = inverse_kinematics_for(asked.arm.robot)
    given = all(isinstance(member, np.ndarray) for member in members(problem.goal))
    return Layer(
        name, held, positions, end, turns, given or (kinematics is not None and kinematics.complete)
    )


def arms_at(asked: Cycle, place: str) -> list[Arm]:
    """The different arms that come to a place, rest at it, or leave it."""
    arms = [
        arm
        for move in asked.moves
        for arm in (
            [move.arm] * (place in (move.start, *move.through, move.goal))
            + [move.arm_after] * (place == move.goal)
        )
    ]
    return list({id(arm): arm for arm in arms}.values())


def _nodes(end: EndConfiguration, windings: bool, middle: Array) -> list[tuple[float, ...]]:
    """Joint positions (nq,) of a configuration: with every full turn, or the ones nearest to the
    middle.

    A sample of infinitely many has one: as many samples as there are turns would add little.
    """
    if windings and not end.sampled:
        return list(product(*end.choices))
    return [
        tuple(
            min(each, key=lambda x: abs(x - m))
            for each, m in zip(end.choices, middle.tolist(), strict=True)
        )
    ]
