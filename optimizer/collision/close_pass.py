"""The least distance of a motion without margins, if it is so small that the real arm could touch.

A pair whose obstacle has a margin of CLOSE or more stays as far apart as that margin, as long as
the margin is kept. Only the other pairs have to be compared a second time, and only if the
clearance beyond the margins is below CLOSE.
"""

from __future__ import annotations

from dataclasses import replace

from joulepath.optimizer.collision.clearance_proof import proven_clearance
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.result.certificate import Clearance

# distance [m] below which a motion is reported to pass close: what the tracking error of a
# controller, the calibration of an arm and the place of a body in a cell add up to
CLOSE = 2e-3


def close_pass(arm: Arm, spline: Spline, clearance: Clearance | None) -> Clearance | None:
    """The least distance of a motion, without margins, if it is not proven to be CLOSE or more;
    else None.

    `clearance` is the proven one of the same motion, margins subtracted; None if no pair is
    checked.
    """
    if clearance is None or clearance.min_clearance >= CLOSE:
        return None
    found = proven_clearance(model_without_margins(arm), spline)
    return found if found is not None and found.min_clearance < CLOSE else None


def model_without_margins(arm: Arm) -> CollisionModel:
    """The collision model of the arm whose obstacles have a margin below CLOSE, with no margin; the
    others left out.
    """
    near = [
        replace(obstacle, margin=0.0) for obstacle in arm.scene.obstacles if obstacle.margin < CLOSE
    ]
    return collision_model(replace(arm, scene=Scene(near)))
