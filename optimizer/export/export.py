"""Public entry point: `export(motion, format)` writes a motion for a robot controller."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.evaluate.sample_check import check_samples
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem
from joulepath.optimizer.export.certified import certified
from joulepath.optimizer.export.csv_table import to_csv
from joulepath.optimizer.export.facts import NOT_RUN, WrittenFile
from joulepath.optimizer.export.formats import FormatName
from joulepath.optimizer.export.franka import FrankaOptions, to_franka
from joulepath.optimizer.export.joint_limits_file import LimitsOptions, to_joint_limits
from joulepath.optimizer.export.json_document import to_json
from joulepath.optimizer.export.krl import KrlOptions, to_krl
from joulepath.optimizer.export.mcap_recording import McapOptions, to_mcap
from joulepath.optimizer.export.npz_arrays import to_npz
from joulepath.optimizer.export.program import Move, Program, program_of_cycle
from joulepath.optimizer.export.rapid import RapidOptions, to_rapid
from joulepath.optimizer.export.ros_messages import MoveitOptions, Ros2Options, to_moveit, to_ros2
from joulepath.optimizer.export.rows import TableOptions
from joulepath.optimizer.export.urscript import UrscriptOptions, to_urscript
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.scalars import check_choice, check_number
from joulepath.optimizer.result.solution import Solution

ExportOptions = (
    UrscriptOptions
    | Ros2Options
    | MoveitOptions
    | FrankaOptions
    | RapidOptions
    | KrlOptions
    | TableOptions
    | McapOptions
    | LimitsOptions
)


@dataclass(frozen=True)
class Format:
    """An export format."""

    meaning: str
    """Description of the format."""
    write: Callable[[Program, Any], WrittenFile]
    options: type[ExportOptions] | None
    """Class of its options; None for a format without options."""


FORMATS: dict[FormatName, Format] = {
    "urscript": Format(
        "A program for Universal Robots controllers that follows the spline with servoj.",
        to_urscript,
        UrscriptOptions,
    ),
    "ros2": Format(
        "A FollowJointTrajectory goal or a JointTrajectory for ros2_control, as YAML or for "
        "rosbridge.",
        to_ros2,
        Ros2Options,
    ),
    "moveit": Format("A RobotTrajectory for MoveIt, as YAML or JSON.", to_moveit, MoveitOptions),
    "franka": Format(
        "A table at 1 kHz for robots of Franka, or a motion generator for libfranka.",
        to_franka,
        FrankaOptions,
    ),
    "rapid": Format(
        "A module for ABB controllers, which keep the times only roughly; the file states the "
        "deviation.",
        to_rapid,
        RapidOptions,
    ),
    "krl": Format(
        "A program for KUKA controllers, which keep the times only roughly; the file states the "
        "deviation.",
        to_krl,
        KrlOptions,
    ),
    "csv": Format(
        "A table of samples: t, q, v, a. `POST /evaluate` reads it.", to_csv, TableOptions
    ),
    "json": Format(
        "The splines themselves, with payloads and rests.",
        lambda program, _: to_json(program),
        None,
    ),
    "npz": Format("Arrays for NumPy: samples and splines.", to_npz, TableOptions),
    "mcap": Format(
        "A recording of ROS 2 for Foxglove, PlotJuggler and `ros2 bag play`.", to_mcap, McapOptions
    ),
    "joint_limits": Format(
        "The `joint_limits.yaml` that the torque limits imply in the postures of the motion, for "
        "MoveIt and ros2_control.",
        to_joint_limits,
        LimitsOptions,
    ),
}
"""The formats by name."""


@dataclass(frozen=True)
class ExportedFile:
    """A file for a robot controller."""

    name: str
    """Suggested name of the file."""
    content: bytes
    media_type: str
    speed_scale: float
    """Share of its speed to which the motion is slowed down [1]."""
    worst_ratio: float
    """Largest value / limit of the motion, by its certificate [1]."""
    notes: tuple[str, ...]
    """Deviations of the file from the motion and omissions, in sentences."""


@overload
def export(
    motion: Solution,
    format: FormatName,
    options: ExportOptions | None = None,
    *,
    problem: Problem,
    speed_scale: float = 1.0,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> ExportedFile: ...
@overload
def export(
    motion: CycleSolution | Program,
    format: FormatName,
    options: ExportOptions | None = None,
    *,
    problem: None = None,
    speed_scale: float = 1.0,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> ExportedFile: ...
@checked_arguments
def export(
    motion: Solution | CycleSolution | Program,
    format: FormatName,
    options: ExportOptions | None = None,
    *,
    problem: Problem | None = None,
    speed_scale: float = 1.0,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> ExportedFile:
    """Write a motion as a program or file for a robot controller.

    The motion is certified again at its exported speed: limits, rest at both ends of every move,
    and clearance. A tool path is not compared again. No format was run on hardware.

    Args:
        motion: solution of a problem or of a cycle, or a program of moves and rests.
        format: name of the format; docs/reference/export.md describes each.
        options: options of this format; None for its defaults.
        problem: problem of a `Solution`, which contains its arm; other motions contain theirs.
        speed_scale: fraction of the speed in (0, 1]. Moves are slowed down, rests are not.
        deadline: wall time after which the certificate is given up [s].
        clock: function for the current time [s].

    Returns:
        The file, with the largest value / limit of its motion.

    Raises:
        InvalidProblem: the options are those of another format, or `problem` is missing.
        NotCertified: the motion exceeds a limit at this speed, or does not belong to the arm.
        FormatUnsuitable: the format is not for this robot, or the file would be too large.
        DeadlineExceeded: the deadline passed first.
    """
    kind = _format(format, options)
    check_number("speed_scale", speed_scale, most=1.0, positive=True)
    program = _program(motion, problem)
    program = program if speed_scale == 1 else program.slowed(speed_scale)
    try:
        with watch(Deadline.after(deadline, clock)):
            certificates = certified(program)
            written = kind.write(program, options)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    scale = program.speed_scale
    speed = "" if scale == 1 else f"-speed-{scale:g}"
    return ExportedFile(
        name=f"joulepath-{program.robot.name}{speed}.{written.extension}",
        content=written.content,
        media_type=written.media_type,
        speed_scale=scale,
        worst_ratio=max(ratio for each in certificates for ratio in each.worst_ratio.values()),
        notes=(*written.notes, NOT_RUN),
    )


def _format(name: FormatName, options: ExportOptions | None) -> Format:
    check_choice("format", name, FormatName)
    kind = FORMATS[name]
    if options is not None and type(options) is not kind.options:
        own = "has no options" if kind.options is None else f"takes {kind.options.__name__}"
        raise InvalidProblem(
            "options", f"The format {name} {own}: leave out {type(options).__name__}."
        )
    return kind


def _program(motion: Solution | CycleSolution | Program, problem: Problem | None) -> Program:
    if isinstance(motion, CycleSolution):
        return program_of_cycle(motion)
    if isinstance(motion, Program):
        return motion
    if problem is None:
        raise InvalidProblem(
            "problem", "A solution does not name its arm: give the problem that it solves."
        )
    given = motion.trajectory
    check_samples(problem.arm, given.spline, given.t, (given.q, given.v, given.a, given.tau))
    return Program((Move(given.spline, problem.arm),))
