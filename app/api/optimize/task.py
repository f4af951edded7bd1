"""What `POST /optimize` answers, and its work in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal, Protocol, Self

from joulepath.app.answers.bounded_energy import EnergyAndBound
from joulepath.app.answers.envelope import AnswerFigures, MotionAnswer
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.candidates import chosen
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.warnings import certified_warnings
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest, WhichCandidates
from joulepath.app.tasks.certified import certified
from joulepath.optimizer.declared import NotEmpty, Seconds
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.candidates import (
    CandidateCounts,
    CandidateReport,
    UnreachableTarget,
    count_by_status,
)
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import (
    Baseline,
    Configuration,
    LimitsInForce,
    Solution,
    SolverReport,
    Trajectory,
)


class Asked(Protocol):
    """What an answer repeats of its request."""

    robot: str
    method: MethodName
    candidates: WhichCandidates

    @property
    def objective(self) -> Objective:
        """The energy that is minimised."""
        ...


@dataclass(frozen=True)
class Branches:
    """The chosen pair of arm configurations."""

    start: Configuration
    """At the start."""
    goal: Configuration
    """At the goal."""


@dataclass(frozen=True, kw_only=True)
class OptimizeAnswer(MotionAnswer):
    """The motion of least energy, its energy with all parts, and a certificate."""

    method: MethodName
    """How the motion is parametrised."""
    objective: Objective
    """Energy that was minimised: electrical energy drawn from the supply, or mechanical work."""
    duration: Seconds
    """Duration of the motion."""
    status: Literal["optimal", "feasible"]
    """`optimal`: the method converged, and every other candidate was solved, is infeasible, or was
    ruled out by its lower bound or its energy; for mechanical work, `optimality_gap` is at most
    0.01, too. It does not say that no better motion exists: see `optimality_gap`. `feasible`: the
    motion is certified, but the search was not complete, or arm configurations may have been
    missed."""
    branch: Branches
    """Arm configurations of the chosen candidate."""
    trajectory: Trajectory
    """The motion."""
    energy: EnergyAndBound
    """Energy and power of the motion."""
    limits: LimitsInForce
    """The limits that the motion was held to."""
    baselines: Annotated[list[Baseline], NotEmpty]
    """The same task by other planners."""
    candidates: list[CandidateReport]
    """Pairs of a start and a goal configuration, with their results, as `candidates` of the request
    asks."""
    candidate_counts: CandidateCounts
    """Number of all candidates by status."""
    unreachable: list[UnreachableTarget]
    """Targets of an `any_of` without candidates, each with the cause."""
    certificate: Certificate
    """Independent check of the motion."""
    warnings: list[str]
    """Remarks on the motion, in words; empty if there are none. If two bodies come closer than 2
    mm, one names them, their distance without margins, and the time. Others say that arm
    configurations may have been missed, that a baseline is left out, or what a tool or payload
    without a shape would touch."""
    solver: SolverReport
    """Effort of the computation."""
    answer: str | None = None
    """Path under which this answer is kept: `GET` returns it again. Null if it is not kept: the
    database cannot be written, the answer is larger than all that the service may keep, or it is a
    part of another answer."""

    @classmethod
    def of(
        cls, request: Asked, request_id: str, solution: Solution, arm: dict[str, Any] | None
    ) -> Self:
        """The answer to a request, not kept yet. `arm` is that of `arm_fields`."""
        return cls(
            request=request_id,
            robot=request.robot,
            arm=arm,
            method=request.method,
            objective=request.objective,
            duration=solution.duration,
            status=solution.status,
            branch=Branches(solution.start, solution.goal),
            trajectory=solution.trajectory,
            energy=EnergyAndBound.bounded(solution.energy, solution.lower_bound, request.objective),
            limits=solution.limits,
            baselines=solution.baselines,
            candidates=chosen(solution.candidates, request.candidates),
            candidate_counts=count_by_status(solution.candidates),
            unreachable=solution.unreachable,
            certificate=solution.certificate,
            warnings=certified_warnings(solution),
            solver=solution.solver,
        )

    @property
    def figures(self) -> AnswerFigures:
        """What lists show of this answer."""
        return AnswerFigures(self.robot, self.energy.of(self.objective), self.duration, self.status)


@dataclass(frozen=True)
class OptimizeTask:
    """A validated request and its id."""

    request: OptimizeRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /optimize`, within about `deadline` seconds."""
        solution = certified(optimize(to_problem(self.request, deadline), tell=listener()))
        answer = OptimizeAnswer.of(
            self.request, self.request_id, solution, arm_fields(self.request)
        )
        return TaskResult.of_kept_json(answer, answer.figures)
