"""`krl`: a program for KUKA controllers (KR C4 and later), with SPTP points in a time block.

Syntax, as in KUKA's manual "KUKA System Software 8.x, operating and programming instructions for
system integrators", chapter on spline motions: `PTP_SPLINE … SPTP {A1 …} … ENDSPLINE`; in it
`TIME_BLOCK START`, after each part `TIME_BLOCK PART = share [%]`, and last `TIME_BLOCK END = time
[s]`.
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.export.even_points import EvenPoints, even_points, smooth, straight
from joulepath.optimizer.export.facts import WrittenFile, check_joints, comment, header, output_note
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.point_options import PointOptions
from joulepath.optimizer.export.principal_axes import principal_axes
from joulepath.optimizer.export.program import Move, Program, Timed
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.scalars import check_within


@dataclass(frozen=True)
class KrlOptions(PointOptions):
    """Options of `krl`."""

    digital_output: int | None = None
    """Number of an output that is on from each grasp to the release; None switches nothing."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.digital_output is not None:
            check_within("digital_output", self.digital_output, OPTION_RANGES.krl_output)


def to_krl(program: Program, options: KrlOptions | None = None) -> WrittenFile:
    """Write a program in KRL.

    Args:
        program: the motion.
        options: points, axes and output; None for the defaults.

    Raises:
        FormatUnsuitable: the robot does not have six joints, or is of another maker.
    """
    options = options or KrlOptions()
    check_joints(
        program, "krl", 6, "KUKA", "robots of KUKA that are programmed in KRL, with six joints"
    )
    options.check("krl", program.robot.nq)
    moves = [even_points(move, (straight, smooth), options.tolerance) for move in program.moves]
    notes = (
        f"within {max(each.deviation for each in moves):.2e} rad of the spline, if the controller "
        "keeps every time",
        "assumed controller: it passes the points at their times, and follows any curve between "
        "them from straight lines in joint space to the cubic spline",
        "delays of a controller that cannot keep a time are not in this bound",
        *output_note(program, options.digital_output),
    )
    lines = ["&ACCESS RVP", "DEF joulepath( )"]
    lines += [f"; {line}" for line in header(program, "program for KUKA controllers", notes)]
    lines += ["BAS (#INITMOV,0)", "BAS (#VEL_PTP,10)", "BAS (#ACC_PTP,10)", _load(program.payload)]
    lines.append(f"PTP {_axes(options, program.start)}")
    points = iter(moves)
    for timed in program.timed:
        lines.append(f"; {comment(timed.step.label)}, {timed.step.duration:.4f} s")
        lines += _switch(timed, options.digital_output)
        if isinstance(timed.step, Move):
            lines += _block(next(points), options)
        else:
            lines.append(f"WAIT SEC {timed.step.duration:.3f}")
    return WrittenFile.of_text("\r\n".join([*lines, "END", ""]), "text/plain", "src", notes)


def _load(load: Payload) -> str:
    x, y, z = (1000 * each for each in load.com)
    (jx, jy, jz), rotation = principal_axes(load)
    # at B = ±90°, where only A ± C is determined, C is zero
    a, b, c = rotation.as_euler("ZYX", degrees=True, suppress_warnings=True)
    return (
        f"$LOAD={{M {load.mass:.4f},CM {{X {x:.3f},Y {y:.3f},Z {z:.3f},A {a:.3f},B {b:.3f},"
        f"C {c:.3f}}},J {{X {jx:.6f},Y {jy:.6f},Z {jz:.6f}}}}}"
    )


def _axes(options: KrlOptions, q: Array) -> str:
    values = options.degrees(q)
    return "{" + ",".join(f"A{k} {value}" for k, value in enumerate(values, 1)) + "}"


def _block(points: EvenPoints, options: KrlOptions) -> list[str]:
    count = len(points.q) - 1
    lines = ["PTP_SPLINE", "  TIME_BLOCK START"]
    for q in points.q[1:]:
        lines.append(f"  SPTP {_axes(options, q)}")
        lines.append(f"  TIME_BLOCK PART = {100 / count:.6f}")
    return [*lines, f"  TIME_BLOCK END = {points.period * count:.6f}", "ENDSPLINE"]


def _switch(timed: Timed, output: int | None) -> list[str]:
    """Lines that switch output and payload before a step."""
    if timed.payload is None:
        return []
    return [
        *([] if output is None else [f"$OUT[{output}]={str(timed.grasps).upper()}"]),
        _load(timed.payload),
    ]
