"""`joint_limits`: limits on speed and acceleration within the torque limits along a motion."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.joint_limits.joint_limits import joint_limits_along
from joulepath.optimizer.problem.scalars import check_text


@dataclass(frozen=True)
class LimitsOptions:
    """Options of `joint_limits`."""

    prefix: str = ""
    """Prefix of all joint names."""

    def __post_init__(self) -> None:
        check_text("prefix", self.prefix, OPTION_RANGES.prefix)


def to_joint_limits(program: Program, options: LimitsOptions | None = None) -> WrittenFile:
    """Write the joint limits of a program, for planners with their own timing of its path.

    Args:
        program: the motion.
        options: prefix; None for the defaults.

    Raises:
        NoJointLimits: gravity leaves too little torque in some posture.
        DeadlinePassed: the watched deadline passed.
    """
    found = joint_limits_along([(move.spline, move.arm) for move in program.moves])
    notes = ("the limits hold only on this path, also at other speeds and accelerations",)
    text = found.to_yaml((options or LimitsOptions()).prefix)
    return WrittenFile.of_text(text, "application/yaml", "yaml", notes)
