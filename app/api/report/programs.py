"""The arms and motions of a report's documents."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.bundle import Bundle
from joulepath.app.convert.given_answer import arm_fields_of, to_program
from joulepath.optimizer.export.program import Program

Json = dict[str, Any]


def program_of(bundle: Bundle) -> Program:
    """The motions of a report on a motion or a cycle, their samples checked. Raises NotCertified or
    InvalidProblem.
    """
    if bundle.kind == "optimize":
        return program_of_motion(bundle.request, bundle.answer)
    return to_program(bundle.answer, None, bundle.moves)


def program_of_motion(request: Json, answer: Json) -> Program:
    """The motion of an answer of `POST /optimize`. Raises as `program_of`."""
    # where the arm is too large to be repeated, the request has it
    own = None if answer.get("arm") is not None else arm_fields_of(request)
    return to_program(answer, own, [])
