"""Request and answer of `POST /pareto`, and its task in a worker."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from joulepath.app.answers.declared import as_json
from joulepath.app.answers.envelope import Answer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm import arm_fields
from joulepath.app.convert.request import to_problem
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.common import described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.request import DurationRange, OptimizeRequest
from joulepath.app.tasks.answer_collector import AnswerCollector
from joulepath.optimizer.declared import Joules, NotEmpty, Ratio, Seconds, Watts
from joulepath.optimizer.pareto import PARETO, pareto
from joulepath.optimizer.presentation.declared_fields import shown_fields
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.front import Dropped, FrontSolver
from joulepath.optimizer.result.solution import Solution


class ParetoRequest(OptimizeRequest):
    """A request for the Pareto front of duration and energy of a motion."""

    points: int = described(
        "Largest number of durations to solve.",
        "1",
        12,
        default=12,
        ge=PARETO.least_points,
        le=PARETO.most_points,
    )
    duration: DurationRange | None = described(
        "Bounds on the durations of the front. Null: from the shortest feasible duration to the "
        "duration of least energy. The objective `mechanical` needs a `max` or a `dwell`.",
        "s",
        {"max": 3.0},
        default=None,
    )
    deadline: DeadlineSeconds = described(
        "Wall time for the whole front, including the wait for a worker. When it passes, the "
        "service returns the front found so far.",
        "s",
        30.0,
        default=30.0,
    )


@dataclass(frozen=True, kw_only=True)
class ParetoPoint:
    """A motion of the front: no other motion found is better in both duration and energy."""

    duration: Seconds
    """Duration of the motion."""
    energy: Joules
    """Energy of the motion, of the objective."""
    start: str
    """Branch at the start."""
    goal: str
    """Branch at the goal."""
    electrical: Joules
    """Energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    mean_power: Watts
    """Mean power drawn from the supply."""
    peak_power: Watts
    """Largest power drawn from the supply."""
    lower_bound: Joules
    """Lower bound of the objective: no motion of this duration needs less."""
    status: Literal["optimal", "feasible"]
    """Status as `POST /optimize` returns it for this duration."""
    certified: bool
    """Whether the certificate is valid: always true, because other motions are not returned."""
    worst_ratio: Ratio
    """Largest value / limit over all limits."""
    answer: str
    """Path of the complete answer of `POST /optimize`."""

    @classmethod
    def of(cls, motion: Solution, objective: Objective, answer: str) -> Self:
        """The point of a motion with its complete answer stored under the path `answer`."""
        energy = motion.energy
        return cls(
            duration=motion.duration,
            energy=energy.of(objective),
            start=motion.start.label,
            goal=motion.goal.label,
            electrical=energy.electrical.total,
            mechanical=energy.mechanical.total,
            mean_power=energy.mean_power,
            peak_power=energy.peak_power,
            lower_bound=motion.lower_bound,
            status=motion.status,
            certified=motion.certificate.valid,
            worst_ratio=max(motion.certificate.worst_ratio.values()),
            answer=answer,
        )


@dataclass(frozen=True, kw_only=True)
class ParetoAnswer(Answer):
    """The Pareto front of duration and energy."""

    method: MethodName
    """How the motions are parametrised."""
    objective: Objective
    """Energy that was minimised: electrical energy drawn from the supply, or mechanical work."""
    status: Literal["optimal", "feasible"]
    """`optimal`: every chosen duration was solved, and every point is `optimal`. `feasible`: every
    point is certified, but the deadline passed or some point is not `optimal`."""
    shortest: Seconds
    """Duration of the fastest motion found, over all candidates: the `shortest` of
    `duration-too-short`."""
    points: Annotated[list[ParetoPoint], NotEmpty]
    """Points of the front, in order of duration."""
    dropped: list[Dropped]
    """Durations that were solved and are not points of the front."""
    solver: FrontSolver
    """Effort of the computation."""


@dataclass(frozen=True)
class ParetoTask:
    """A validated request and its id; the media type of the answer is `wanted`."""

    request: ParetoRequest
    request_id: str
    wanted: Literal["json", "csv"]

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /pareto`, within about `deadline` seconds."""
        asked, collector = self.request, AnswerCollector()
        front = pareto(to_problem(asked, deadline), asked.points, tell=listener(), progress=False)
        arm = arm_fields(asked)
        points = list[ParetoPoint]()
        for motion in front.points:
            path = collector.add(OptimizeAnswer.of(asked, self.request_id, motion, arm))
            points.append(ParetoPoint.of(motion, asked.objective, path))
        if self.wanted == "csv":
            return TaskResult.of_csv(_rows(points), collector.stored)
        answer = ParetoAnswer(
            request=self.request_id,
            robot=asked.robot,
            method=asked.method,
            objective=asked.objective,
            status=front.status,
            shortest=front.shortest,
            points=points,
            dropped=front.dropped,
            solver=front.solver,
        )
        return TaskResult.of_json(answer, collector.stored)


def _rows(points: list[ParetoPoint]) -> list[Iterable[Any]]:
    """One row per point; columns are named as in the JSON answer."""
    return [shown_fields(ParetoPoint), *(as_json(point).values() for point in points)]
