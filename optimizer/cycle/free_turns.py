"""Orientations of the tool at stops of partly free orientation among obstacles."""

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
from joulepath.optimizer.search.free_members import denser_ends, evenly_chosen


def free_turns(cycle: Cycle, stop: Stop) -> list[Turns]:
    """Turns of the tool at a stop, spread evenly over all allowed orientations.

    If the arm collides at every one of these turns, denser turns are checked, and some of the
    collision-free ones are returned. Without any, the result is the colliding turns, for which the
    search reports the collision.

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
    name, tried = f"stops/{stop.name}", turned_poses(pose, turns)
    rests = rests_at(cycle, ModelsOfArms(), stop.name, tried, stop.branch)

    def are_free(q: Array) -> Mask:
        return np.array([cause is None for cause in first_causes(rests, q)], dtype=bool)

    ends, _ = ends_of(rests[0], name, tried)
    if are_free(np.array([end.q for end in ends])).any():
        return turns
    denser = denser_ends(rests[0], name, pose, [], are_free)
    (reference,) = sample_orientations(pose, 1)
    chosen = evenly_chosen(denser, len(TOOL_TURNS.angles))
    rotations = [tcp_pose(cycle.arm, end.q)[:3, :3] for end in chosen]
    return [(np.asarray(pin.log3(reference.T @ R)), np.zeros(3)) for R in rotations] or turns
