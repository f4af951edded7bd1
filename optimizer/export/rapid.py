"""`rapid`: a module for ABB controllers, MoveAbsJ through points at equal times.

Syntax, as in ABB's technical reference manual "RAPID Instructions, Functions and Data types"
(3HAC050917): `MoveAbsJ ToJointPos [\\NoEOffs] Speed [\\V] | [\\T] Zone [\\Z] Tool`; `\\T` is the
total time of the movement [s].
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.export.even_points import EvenPoints, even_points, rounded, straight
from joulepath.optimizer.export.facts import WrittenFile, check_joints, comment, header, output_note
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.point_options import PointOptions
from joulepath.optimizer.export.principal_axes import principal_axes
from joulepath.optimizer.export.program import Move, Program, Timed
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.scalars import check_text

"""Names of signals in RAPID."""
_NO_EXTERNAL_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"


@dataclass(frozen=True)
class RapidFormat:
    """Properties of the format."""

    min_tool_mass: float = 0.001
    """Smallest mass of a tool [kg]; the controller refuses a tool without mass."""


RAPID = RapidFormat()


@dataclass(frozen=True)
class RapidOptions(PointOptions):
    """Options of `rapid`."""

    digital_output: str | None = None
    """Name of a signal that is on from each grasp to the release; None switches nothing."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.digital_output is not None:
            check_text("digital_output", self.digital_output, OPTION_RANGES.signal)


def to_rapid(program: Program, options: RapidOptions | None = None) -> WrittenFile:
    """Write a program in RAPID.

    Args:
        program: the motion.
        options: points, axes and output; None for the defaults.

    Raises:
        FormatUnsuitable: the robot does not have six joints, or is of another maker.
    """
    options = options or RapidOptions()
    check_joints(program, "rapid", 6, "ABB", "robots of ABB, with six joints")
    options.check("rapid", program.robot.nq)
    moves = [even_points(move, (straight, rounded), options.tolerance) for move in program.moves]
    notes = (
        f"within {max(each.deviation for each in moves):.2e} rad of the spline, if the controller "
        "keeps every time",
        "assumed controller: straight lines in joint space, each in its time, with corners "
        "rounded by any amount up to the middles of the lines",
        "delays of a controller that cannot keep a time are not in this bound",
        *output_note(program, options.digital_output),
    )
    loads = _loads(program)
    lines = ["MODULE Joulepath"]
    lines += [f"  ! {line}" for line in header(program, "module for ABB controllers", notes)]
    lines += [_tool(k, load) for k, load in enumerate(loads)]
    lines += [
        "  PROC joulepath()",
        "    " + _instruction(options.degrees(program.start), "v50", "fine", 0),
    ]
    tool, points = 0, iter(moves)
    for timed in program.timed:
        lines.append(f"    ! {comment(timed.step.label)}, {timed.step.duration:.4f} s")
        if timed.payload is not None:
            tool += 1
            lines += _switch(timed, options.digital_output)
        if isinstance(timed.step, Move):
            lines += _moves(next(points), options, tool)
        else:
            lines.append(f"    WaitTime {timed.step.duration:.3f};")
    lines += ["  ENDPROC", "ENDMODULE"]
    return WrittenFile.of_text("\n".join(lines) + "\n", "text/plain", "mod", notes)


def _loads(program: Program) -> list[Payload]:
    return [
        program.payload,
        *(timed.payload for timed in program.timed if timed.payload is not None),
    ]


def _tool(number: int, load: Payload) -> str:
    com = ",".join(f"{1000 * x:.3f}" for x in load.com)
    moments, rotation = principal_axes(load)
    aom = ",".join(f"{x:.7f}" for x in rotation.as_quat(scalar_first=True))
    inertia = ",".join(f"{x:.6f}" for x in moments)
    mass = max(load.mass, RAPID.min_tool_mass)
    return (
        "  PERS tooldata "
        f"jpTool{number}:=[TRUE,[[0,0,0],[1,0,0,0]],[{mass:.4f},[{com}],[{aom}],{inertia}]];"
    )


def _instruction(axes: list[str], speed: str, zone: str, tool: int) -> str:
    return (
        f"MoveAbsJ [[{','.join(axes)}],{_NO_EXTERNAL_AXES}]\\NoEOffs,{speed},{zone},jpTool{tool};"
    )


def _moves(points: EvenPoints, options: RapidOptions, tool: int) -> list[str]:
    speed, last = f"v1000\\T:={points.period:.9f}", len(points.q) - 1
    rows = enumerate(points.q[1:], 1)
    return [
        "    " + _instruction(options.degrees(q), speed, "fine" if k == last else "z10", tool)
        for k, q in rows
    ]


def _switch(timed: Timed, output: str | None) -> list[str]:
    return [] if output is None else [f"    SetDO {output},{int(timed.grasps)};"]
