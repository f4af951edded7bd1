"""The arms and motions of a report's documents."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.bundle import Bundle
from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.given_answer import paths_of_moves, to_program
from joulepath.app.schemas.arm import ArmRequest
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.problem.arm import Arm

Json = dict[str, Any]


def program_of(bundle: Bundle) -> Program:
    """The motions of a report on a motion or a cycle, their samples checked. Raises NotCertified or
    InvalidProblem.
    """
    if bundle.kind == "optimize":
        return program_of_motion(bundle.request, bundle.answer)
    moves = dict(zip(paths_of_moves(bundle.answer), bundle.moves, strict=True))
    return to_program(bundle.answer, None, lambda names: [moves[name] for name in names])


def program_of_motion(request: Json, answer: Json) -> Program:
    """The motion of an answer of `POST /optimize`. Raises as `program_of`."""
    # where the arm is too large to be repeated, the request has it
    own = None if answer.get("arm") is not None else _arm_fields(request)
    return to_program(answer, own, lambda _: [])


def arm_of(request: Json, answer: Json) -> Arm:
    """The arm of an answer, see `program_of_motion`. Raises InvalidProblem."""
    known = answer.get("arm")
    fields = _arm_fields(request) if known is None else ArmRequest.model_validate(known)
    return to_arm(fields.model_copy(update={"robot": answer["robot"]}))


def _arm_fields(request: Json) -> ArmRequest:
    return ArmRequest.model_validate(
        {name: value for name, value in request.items() if name in ArmRequest.model_fields}
    )
