"""From the arm in a request to the description of a user's own arm."""

from __future__ import annotations

from typing import Any

from joulepath.app.convert.base64_data import decoded
from joulepath.app.schemas import own_arm as asked
from joulepath.models.own_arm.description import Collision, Description, Drives, Electronics, Motion, PerJoint
from joulepath.models.own_arm.mesh_files import in_zip
from joulepath.optimizer.deadline import checkpoint


def to_description(arm: asked.OwnArm) -> Description:
    """The description of the library. Raises InvalidArm or InvalidProblem for meshes that are no zip,
    and DeadlinePassed once a watched deadline has passed."""
    motion, collision = arm.default_motion, arm.collision
    capsules = {name: tuple(map(_row, rows)) for name, rows in (collision.capsules or {}).items()}
    pairs = None if collision.never_meet is None else tuple((first, second) for first, second in collision.never_meet)
    return Description(
        urdf=arm.urdf,
        tip=arm.tip,
        acceleration=_required(arm.acceleration),
        payload=arm.payload,
        base=arm.base,
        title=arm.title,
        source=arm.source,
        trust=arm.trust,
        velocity=_per_joint(arm.velocity),
        torque=_per_joint(arm.torque),
        torque_side=arm.torque_side,
        jerk=_per_joint(arm.jerk),
        locked=arm.locked,
        drives=Drives(**{name: _per_joint(value) for name, value in arm.drives}),
        electronics=Electronics(**dict(arm.electronics)),
        collision=Collision(capsules, collision.radius, pairs),
        srdf=arm.srdf,
        meshes=None if arm.meshes is None else in_zip(decoded(arm.meshes, "meshes"), checkpoint),
        default_motion=None if motion is None else Motion(motion.velocity, motion.acceleration),
    )


def _required(value: float | list[float]) -> PerJoint:
    return tuple(value) if isinstance(value, list) else value


def _per_joint(value: float | list[float] | None) -> PerJoint | None:
    return None if value is None else _required(value)


def _row(row: list[float]) -> Any:
    return tuple(row)
