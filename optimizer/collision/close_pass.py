"""Least distance of a motion without margins, if it is so small that the real arm could touch.

If an obstacle has a margin of at least `CLOSE_PASS.distance` and keeps it, its pairs stay at least
that far apart. Only the other pairs are compared a second time, and only if the clearance beyond
the margins is below that distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from joulepath.optimizer.collision.clearance_proof import proven_clearance
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.result.certificate import Clearance


@dataclass(frozen=True)
class ClosePassSettings:
    """Report of close passes."""

    distance: float = 2e-3
    """Distance [m] below which a motion is reported as a close pass: the sum of the tracking error
    of a controller, the calibration error of an arm and the placement error of a body in a cell.
    """


CLOSE_PASS = ClosePassSettings()


def close_pass(arm: Arm, spline: Spline, clearance: Clearance | None) -> Clearance | None:
    """Least distance of a motion, without margins, unless it is proven to be at least
    `CLOSE_PASS.distance`; then None.

    `clearance` is the proven clearance of the same motion, with margins subtracted; None if no pair
    is checked.
    """
    if clearance is None or clearance.min_clearance >= CLOSE_PASS.distance:
        return None
    if all(obstacle.margin == 0.0 for obstacle in arm.scene.obstacles):
        return clearance
    without_margins = proven_clearance(model_without_margins(arm), spline)
    if without_margins is None or without_margins.min_clearance >= CLOSE_PASS.distance:
        return None
    return without_margins


def model_without_margins(arm: Arm) -> CollisionModel:
    """Collision model of the arm with the obstacles of margins below `CLOSE_PASS.distance`, without
    their margins.
    """
    obstacles = [
        replace(obstacle, margin=0.0)
        for obstacle in arm.scene.obstacles
        if obstacle.margin < CLOSE_PASS.distance
    ]
    return collision_model(replace(arm, scene=Scene(obstacles)))
