"""`json`: the splines of a motion, with payloads and rests."""

from __future__ import annotations

import json
from typing import Any

from joulepath.optimizer.export.facts import NOT_RUN, WrittenFile
from joulepath.optimizer.export.program import Move, Program, Timed


def to_json(program: Program) -> WrittenFile:
    """A JSON document with `robot`, `joint_names`, `duration` [s], `speed_scale` and `steps`.

    A step of kind `move` has a clamped B-spline (`degree`, `knots` [s] from its own start,
    `control_points` [point][joint] [rad]), one of kind `rest` stands still for `duration` [s]. Both
    have `t0` [s]. A move has its `payload`, and so does a last rest that changes it.
    """
    content = {
        "robot": program.robot.name,
        "joint_names": list(program.robot.joint_names),
        "duration": program.duration,
        "speed_scale": program.speed_scale,
        "note": NOT_RUN,
        "steps": [_step(program, timed) for timed in program.timed],
    }
    return WrittenFile.of_text(json.dumps(content, allow_nan=False), "application/json", "json")


def _step(program: Program, timed: Timed) -> dict[str, Any]:
    step = timed.step
    content: dict[str, Any] = {
        "kind": "move" if isinstance(step, Move) else "rest",
        "label": step.label,
        "t0": timed.t0,
        "duration": step.duration,
    }
    if isinstance(step, Move):
        spline, payload = step.spline, step.arm.payload
        content["payload"] = {"mass": payload.mass, "com": payload.com.tolist()}
        content["degree"] = spline.degree
        content["knots"] = spline.knots.tolist()
        content["control_points"] = spline.control_points.tolist()
    elif step.payload is not None:
        content["payload"] = {"mass": step.payload.mass, "com": step.payload.com.tolist()}
    return content
