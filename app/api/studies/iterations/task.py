"""The computation of an iteration of a study: its request, with the study's robot, figures and
objective.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any, TypeVar

from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.schemas.studies import IterationBody, OptimizeStep
from joulepath.app.tasks.read_body import HeldBody, pickled_body
from joulepath.optimizer.exceptions import InvalidProblem

R = TypeVar("R", OptimizeRequest, EvaluateRequest)


@dataclass(frozen=True)
class StudyStep:
    """A request to the endpoint `kind` as it is stored, and as it is computed: `optimize`, or the
    document `evaluate`.

    `optimize` of a large body is a HeldBody.
    """

    kind: str
    sent: dict[str, Any]
    optimize: OptimizeRequest | None = None
    evaluate: bytes = b""


@dataclass(frozen=True)
class StudyStepTask:
    """The body of an iteration, too large for the service's process."""

    body: IterationBody | HeldBody
    robot: str
    figures: str | None
    objective: str
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The content of a StudyStep, within a second regardless of `deadline`.

        Raises:
            InvalidProblem: the body contradicts its study.
        """
        assert not isinstance(self.body, HeldBody), "in a worker it is the model itself"
        step = study_step(self.body, self.robot, self.figures, self.objective)
        held = None if step.optimize is None else pickled_body(step.optimize)
        content = (step.kind, step.sent, held, step.evaluate)
        return TaskResult(pickle.dumps(content), "application/x-python-pickle")


def study_step(body: IterationBody, robot: str, figures: str | None, objective: str) -> StudyStep:
    """The step of a body. Raises InvalidProblem if it names another robot or objective than
    its study, or other figures."""
    step = body.root
    if isinstance(step, OptimizeStep):
        asked = _about("optimize", step.optimize, robot=robot, figures=figures, objective=objective)
        # all candidates: suggestions also start from candidates that were ruled out
        computed = asked.model_copy(update={"candidates": "all"})
        return StudyStep(
            "optimize", asked.model_dump(mode="json", exclude_unset=True), optimize=computed
        )
    given = _about("evaluate", step.evaluate, robot=robot, figures=figures)
    sent = given.model_dump(mode="json", exclude_unset=True)
    return StudyStep("evaluate", sent, evaluate=given.model_dump_json(exclude_unset=True).encode())


def large_step(result: TaskResult) -> StudyStep:
    """The step made by a StudyStepTask."""
    kind, sent, held, evaluate = pickle.loads(result.document)
    optimize: Any = None if held is None else HeldBody(*held)
    return StudyStep(kind, sent, optimize, evaluate)


def _about(kind: str, asked: R, **of_study: str | None) -> R:
    for name, value in of_study.items():
        if name in asked.model_fields_set and getattr(asked, name) != value:
            raise InvalidProblem(
                f"{kind}.{name}",
                f"The study has another {name}: leave {name} out, or create another study.",
            )
    # a request without figures leaves the field out instead of null
    return asked.model_copy(
        update={name: value for name, value in of_study.items() if value is not None}
    )
