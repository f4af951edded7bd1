"""Orientations of the tool tried at stops among obstacles, some of them without collisions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.cycle.layers import first_causes, rests_at
from joulepath.optimizer.cycle.tool_turns import TOOL_TURNS, Turns, turned_poses, turns_all_around
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.prepared_problem import ModelsOfArms
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.search.ends import ends_of
from joulepath.optimizer.search.free_members import denser_ends


def free_turns(cycle: Cycle, stop: Stop) -> list[Turns]:
    """Turns at a stop over all orientations, or else over those without collisions.

    If the arm collides at all turns spread over the orientations, turns without collisions are
    sought among denser ones. If there are none either, the former are returned.

    Raises:
        UnreachableTargets: the stop is out of reach at all turns.
        JoulepathError: the errors of `turns_all_around`.
    """
    turns = turns_all_around(cycle.arm, stop)
    pose = stop.target
    if not isinstance(pose, ConeOrientedPose) or stop.path is not None:
        return turns
    if not cycle.arm.scene.names:
        return turns
    name, arm, tried = f"stops/{stop.name}", cycle.arm, turned_poses(pose, turns)
    rests = rests_at(cycle, ModelsOfArms(), stop.name, tried, stop.branch)

    def are_free(q: Array) -> Mask:
        return np.array([cause is None for cause in first_causes(rests, q)], dtype=bool)

    ends, _ = ends_of(rests[0], name, tried)
    if are_free(np.array([end.q for end in ends])).any():
        return turns
    denser = denser_ends(rests[0], name, pose, [], are_free)
    (reference,) = sample_orientations(pose, 1)
    found = [tcp_pose(arm, end.q)[:3, :3] for end in denser]
    chosen = found[:: max(len(found) // len(TOOL_TURNS.angles), 1)][: len(TOOL_TURNS.angles)]
    none = np.zeros(3)
    return [(np.asarray(pin.log3(reference.T @ R)), none) for R in chosen] or turns
