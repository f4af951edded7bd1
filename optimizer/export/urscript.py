"""`urscript`: a program for Universal Robots controllers that follows the spline with servoj.

Syntax and functions are those of the maker's script manual (PolyScope 5, e-series; CB3 has the
same):
https://www.universal-robots.com/manuals/EN/HTML/SW5_20/Content/prod-scriptmanual/G5/servoj_qavt0-008lookahead_time.htm
servoj controls the arm for `t` seconds and then returns; with t = 0.002 s (CB3: 0.008 s) one call
is one period of the controller. A program that is sent over a socket begins with `def` and ends
with `end` in the first column, and every other line is indented (page "Connecting to URControl" of
the same manual). Under speed scaling servoj takes longer:
https://www.universal-robots.com/articles/ur/programming/trajectory-improvements-for-servoj
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.facts import WrittenFile, check_joints, comment, header, output_note
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.pieces import pieces
from joulepath.optimizer.export.program import Move, Program, Timed
from joulepath.optimizer.export.urscript_parts import CHECKS, serving
from joulepath.optimizer.motion.spline import peak_rates
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_within


@dataclass(frozen=True)
class UrscriptFormat:
    """Properties of the format."""

    max_pieces: int = 2_000
    """Largest number of polynomials of a program: about a megabyte."""
    max_points: int = 20_000
    """Largest number of set points of a program: about two megabytes."""
    set_point_error: float = 1e-9
    """Bound on rounding errors of the coefficients, 5e-13 rad each, and of the sums of the
    controller [rad]."""
    min_tracking: float = 0.05
    """Distance from a set point at which an arm at rest is stopped [rad]."""
    tracking_time: float = 0.1
    """Time that is added to `lookahead_time`, by which an arm follows its set points [s]; both
    times the speed widen the distance at which the arm is stopped."""


URSCRIPT = UrscriptFormat()


@dataclass(frozen=True)
class UrscriptOptions:
    """Options of `urscript`."""

    rate: Literal[500, 125] = 500
    """Rate of the controller [Hz]: 500 for e-series, 125 for CB3."""
    form: Literal["polynomials", "points"] = "polynomials"
    """Polynomials, evaluated by the controller, or all set points."""
    lookahead_time: float = 0.1
    """Parameter of servoj [s]."""
    gain: float = 300.0
    """Parameter of servoj."""
    digital_output: int | None = None
    """Standard output that is on while the arm carries more than at the start; None switches
    nothing."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_within("lookahead_time", self.lookahead_time, OPTION_RANGES.lookahead_time, "seconds")
        check_within("gain", self.gain, OPTION_RANGES.gain)
        if self.digital_output is not None:
            check_within("digital_output", self.digital_output, OPTION_RANGES.standard_output)


def to_urscript(program: Program, options: UrscriptOptions | None = None) -> WrittenFile:
    """Write a program in URScript.

    Args:
        program: the motion.
        options: controller, form and output; None for the defaults.

    Raises:
        FormatUnsuitable: the robot is not one of Universal Robots, or the program would be too
            large.
    """
    options = options or UrscriptOptions()
    check_joints(
        program, "urscript", 6, "Universal Robots", "robots of Universal Robots, with six joints"
    )
    _check_size(program, options)
    fastest = max(float(peak_rates(move.spline)[0].max()) for move in program.moves)
    tracking = URSCRIPT.min_tracking + fastest * (options.lookahead_time + URSCRIPT.tracking_time)
    notes = (
        f"set points every {1000 / options.rate:g} ms by servoj, within "
        f"{URSCRIPT.set_point_error:.0e} rad of the spline",
        f"the arm follows the set points about lookahead_time = {options.lookahead_time:g} s later",
        f"the program stops if a joint is more than {tracking:.3f} rad away from its set point",
        "at the end of a move, the program waits up to 1 s until every joint is within 0.001 rad",
        "while the controller scales the speed down, servoj takes longer, and so does the motion",
        *_output_notes(program, options),
    )
    degree = max(move.spline.degree for move in program.moves)
    lines = ["def joulepath():"]
    lines += [
        f"  # {line}" for line in header(program, "program for Universal Robots controllers", notes)
    ]
    lines += [
        *CHECKS,
        *serving(options.rate, options.lookahead_time, options.gain, tracking, degree),
    ]
    lines += [*_beginning(program), *_body(program, options, degree), "end"]
    return WrittenFile.of_text("\n".join(lines) + "\n", "text/plain", "script", notes)


def _numbers(values: Array) -> str:
    """A list of numbers in positional notation, to 1e-12."""
    return "[" + ", ".join(_number(x) for x in values) + "]"


def _number(x: float) -> str:
    whole, _, rest = f"{x + 0.0:.12f}".partition(".")
    return f"{whole}.{rest.rstrip('0') or '0'}"


def _check_size(program: Program, options: UrscriptOptions) -> None:
    if options.form == "points":
        count, most, what = (
            sum(int(m.duration * options.rate) + 1 for m in program.moves),
            URSCRIPT.max_points,
            "set points",
        )
    else:
        count, most, what = (
            sum(len(pieces(m.spline)[0]) - 1 for m in program.moves),
            URSCRIPT.max_pieces,
            "polynomials",
        )
    if count > most:
        raise FormatUnsuitable(
            "urscript",
            f"The program would have {count} {what}, and has at most {most}: export it move by "
            "move, or as ros2.",
        )


def _output_notes(program: Program, options: UrscriptOptions) -> tuple[str, ...]:
    output = options.digital_output
    if output is None or all(timed.payload is None for timed in program.timed):
        return output_note(program, output)
    return (
        f"standard digital output {output} is on from each grasp to the release",
        "the time for the gripper is the dwell at the stop",
    )


def _beginning(program: Program) -> list[str]:
    """Checks, payload, and a slow move to the start."""
    start = _numbers(program.start)
    return [
        f"  # {comment(program.timed[0].step.label)}: the start, in joint space",
        f"  local jp_start = {start}",
        f"  if norm(get_target_payload() - {program.payload.mass:.6f}) > 0.05:",
        '    popup("The active payload differs from that of the motion, '
        f'{program.payload.mass:.3f} kg. Continue sets it.", "joulepath", True, False, '
        "blocking=True)",
        "  end",
        *_payload(program.payload),
        "  if jp_far(get_actual_joint_positions(), jp_start) > 0.01:",
        '    popup("The arm is not at the start of the motion. Continue moves it there slowly, '
        "with no check for "
        'obstacles.", "joulepath", True, False, blocking=True)',
        "    movej(jp_start, a=0.3, v=0.2)",
        "  end",
        "  if jp_far(get_actual_joint_positions(), jp_start) > 0.01:",
        '    jp_stop("The arm did not reach the start of the motion.")',
        "  end",
    ]


def _payload(payload: Payload) -> list[str]:
    return [f"  jp_payload({payload.mass:.6f}, {_numbers(payload.com)})"]


def _body(program: Program, options: UrscriptOptions, degree: int) -> list[str]:
    lines = list[str]()
    for timed in program.timed:
        lines.append(f"  # {comment(timed.step.label)}, {timed.step.duration:.4f} s")
        lines += _switch(timed, options)
        if not isinstance(timed.step, Move):
            lines.append(f"  sleep({timed.step.duration:.6f})")
        elif options.form == "points":
            lines += _points(timed.step, options.rate)
        else:
            lines += _polynomials(timed.step, degree)
    return lines


def _switch(timed: Timed, options: UrscriptOptions) -> list[str]:
    """Lines that switch output and payload before a step."""
    if timed.payload is None:
        return []
    output = (
        []
        if options.digital_output is None
        else [f"  set_standard_digital_out({options.digital_output}, {timed.grasps})"]
    )
    return [*output, *_payload(timed.payload)]


def _polynomials(move: Move, degree: int) -> list[str]:
    edges, coefficients = pieces(move.spline)
    padded = np.zeros((len(coefficients), degree + 1, coefficients.shape[2]))
    padded[:, : coefficients.shape[1]] = coefficients
    calls = [
        f"  jp_piece({begin:.12f}, {end:.12f}, {_numbers(each.ravel())})"
        for begin, end, each in zip(edges[:-1], edges[1:], padded, strict=True)
    ]
    return ["  jp_tick = 1", *calls, f"  jp_arrive({_numbers(move.spline.control_points[-1])})"]


def _points(move: Move, rate: int) -> list[str]:
    ticks = np.arange(1, int(np.ceil(move.duration * rate - 1e-6)) + 1) / rate
    q = move.spline.curve(np.minimum(ticks, move.duration))
    return [
        *(f"  jp_servo({_numbers(row)})" for row in q),
        f"  jp_arrive({_numbers(move.spline.control_points[-1])})",
    ]
