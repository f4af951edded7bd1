"""`franka`: samples at the 1 kHz of Franka's control interface, as CSV or as a header for
libfranka.

The header holds a motion generator: a callable from `franka::RobotState` and `franka::Duration` to
`franka::JointPositions`, as `franka::Robot::control` takes it, which ends with
`franka::MotionFinished`; see generate_joint_position_motion.cpp among the examples of libfranka.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.optimizer.export.csv_table import csv_text
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.facts import WrittenFile, check_joints, header
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.export.rows import TABLE, ticks
from joulepath.optimizer.problem.declared_types import check_fields


@dataclass(frozen=True)
class FrankaFormat:
    """Properties of the format."""

    period: float = 1e-3
    """Period of the control interface [s]."""
    max_compiled_rows: int = 30_000
    """Largest number of rows of a header; a compiler takes seconds for it."""
    rounding: float = 1e-12
    """Rounding error of the positions [rad]."""


FRANKA = FrankaFormat()


@dataclass(frozen=True)
class FrankaOptions:
    """Options of `franka`."""

    form: Literal["csv", "cpp"] = "csv"
    """A table as CSV, or a C++ header with a motion generator."""

    def __post_init__(self) -> None:
        check_fields(self)


def to_franka(program: Program, options: FrankaOptions | None = None) -> WrittenFile:
    """Write a program as a table or a header.

    Args:
        program: the motion.
        options: form of the file; None for the defaults.

    Raises:
        FormatUnsuitable: the robot is not one of Franka, the payload changes, or the file would be
            too large.
    """
    options = options or FrankaOptions()
    check_joints(program, "franka", 7, "Franka Robotics", "robots of Franka, with seven joints")
    if program.changes_payload:
        raise FormatUnsuitable(
            "franka",
            "The payload changes during the motion, and a motion generator cannot switch it: "
            "export move by move.",
        )
    t = ticks(
        program,
        FRANKA.period,
        "franka",
        TABLE.max_rows if options.form == "csv" else FRANKA.max_compiled_rows,
    )
    q, v, _ = program.at(t)
    notes = (
        f"a row every millisecond, exact to {FRANKA.rounding:.0e} rad, the last at the goal",
        "set the payload with setLoad first, and move to the start with your own motion",
        "limits of the FR3 that depend on the joint positions are not checked",
    )
    if options.form == "csv":
        text = csv_text(t, {"q": q, "v": v}, ["%.3f"] + ["%.12f"] * 14)
        return WrittenFile.of_text(text, "text/csv", "csv", notes)
    rows = "\n".join("    {{" + ", ".join(f"{x:.12f}" for x in row) + "}}," for row in q)
    head = "\n".join(
        f"// {line}" for line in header(program, "motion generator for libfranka", notes)
    )
    return WrittenFile.of_text(
        _HEADER.format(head=head, count=len(q), rows=rows), "text/plain", "hpp", notes
    )


_HEADER = """{head}
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include <franka/control_types.h>
#include <franka/duration.h>
#include <franka/robot_state.h>

namespace joulepath {{

// joint positions [rad], one row per millisecond
constexpr std::size_t kRows = {count};
constexpr std::array<std::array<double, 7>, kRows> kPositions = {{{{
{rows}
}}}};

// for franka::Robot::control; throws if the arm is not at the start
class Motion {{
 public:
  franka::JointPositions operator()(const franka::RobotState& state, franka::Duration period) {{
    if (tick_ == 0) {{
      for (std::size_t joint = 0; joint < 7; joint++) {{
        if (std::abs(state.q_d[joint] - kPositions[0][joint]) > 1e-3) {{
          throw std::runtime_error("joulepath: the arm is not at the start of the motion");
        }}
      }}
    }}
    tick_ += period.toMSec();
    franka::JointPositions next(kPositions[std::min<std::size_t>(tick_, kRows - 1)]);
    return tick_ >= kRows - 1 ? franka::MotionFinished(next) : next;
  }}

 private:
  std::size_t tick_ = 0;
}};

}}  // namespace joulepath
"""
