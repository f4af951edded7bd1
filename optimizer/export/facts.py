"""Header, notes and plain text of exported files."""

from __future__ import annotations

import re
from dataclasses import dataclass

from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.program import Program

NOT_RUN = (
    "Not tested on hardware: run the file in the simulator of the manufacturer, then slowly, "
    "with a hand on the stop button."
)
_NOT_PLAIN = re.compile(r"[^A-Za-z0-9 .,:+\-/()=%_]")


@dataclass(frozen=True)
class WrittenFile:
    """A file in one format."""

    content: bytes
    media_type: str
    extension: str
    notes: tuple[str, ...] = ()
    """Deviations of the file from the motion and omissions, in sentences."""

    @staticmethod
    def of_text(
        text: str, media_type: str, extension: str, notes: tuple[str, ...] = ()
    ) -> WrittenFile:
        """A file of text."""
        return WrittenFile(text.encode(), media_type, extension, notes)


def comment(text: str, max_length: int = 160) -> str:
    """One line of plain ASCII text that cannot end a comment or a string of any format."""
    return _NOT_PLAIN.sub("?", text)[:max_length]


def header(program: Program, title: str, notes: tuple[str, ...]) -> list[str]:
    """Lines at the head of a file, before which the writer of a format puts its comment sign."""
    scale = program.speed_scale
    slowed = (
        "at full speed"
        if scale == 1
        else f"slowed down to {scale:.4g} of its speed, certified at this speed"
    )
    payload = program.payload
    com = ", ".join(f"{x:.4f}" for x in payload.com)
    lines = [
        f"joulepath: {title}",
        f"robot {program.robot.name} ({program.robot.title}), {program.duration:.4f} s, {slowed}",
        f"payload at the start {payload.mass:.4g} kg, centre of mass ({com}) m in the flange frame",
        *notes,
        NOT_RUN,
    ]
    return [comment(line) for line in lines]


def output_note(program: Program, output: int | str | None) -> tuple[str, ...]:
    """Note for the program of a cycle without a switched output."""
    if output is not None or all(timed.payload is None for timed in program.timed):
        return ()
    return (
        "no output is switched where the payload changes: give digital_output, or add the gripper "
        "commands",
    )


def check_joints(program: Program, format: str, nq: int, maker: str, arms: str) -> None:
    """Check that a format fits the robot.

    Args:
        program: the motion.
        format: name of the format in error messages.
        nq: number of joints of the format.
        maker: maker of the robots.
        arms: description of the robots in error messages.

    Raises:
        FormatUnsuitable: the robot has another number of joints, or is known to be of another
            maker.
    """
    robot = program.robot
    # users' own arms have no maker: their number of joints decides
    if robot.nq == nq and robot.maker in (maker, None):
        return
    has = f"{robot.nq} joints" if robot.nq != nq else f"a controller of {robot.maker}"
    raise FormatUnsuitable(
        format,
        f"The format {format} is for {arms}, and this robot has {has}: use ros2, moveit, csv, json "
        "or npz.",
    )
