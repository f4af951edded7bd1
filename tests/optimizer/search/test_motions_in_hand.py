"""An answer needs no more than a feasible motion in hand: earlier motions of a candidate, and
baselines of its kind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from joulepath import Certificate, DeadlineExceeded, Solution, Spline, optimize
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import DeadlinePassed
from joulepath.optimizer.feasible_answer import least_certified
from joulepath.optimizer.motion.spline import lasting
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.search import baseline_comparison
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods import METHODS
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from tests.optimizer.clocks import CountingClock, still
from tests.optimizer.moves import GOAL, PAYLOAD, START, fixed, problem
from tests.optimizer.search.runs import prepared
from tests.selection import long_but

# relative error of the compared quadratures, `state.ENERGY_TOLERANCE`
SLACK = 1e-6
# s: the quintic, and motions like it, are within all limits
SLOW = 3.0


@dataclass(frozen=True)
class Known:
    """Something in hand, certified or not."""

    cost: float
    confirmed: bool = True

    def certified(self) -> str | None:
        return f"{self.cost:g} J" if self.confirmed else None


def test_the_least_that_is_certified_is_the_answer() -> None:
    assert least_certified([Known(3.0), Known(2.0), Known(1.0, confirmed=False)]) == "2 J"
    assert least_certified([Known(1.0, confirmed=False)]) is None
    assert least_certified([]) is None
    # negative energies come first; among equal energies, the first motion wins
    assert least_certified([Known(0.0), Known(-1.0)]) == "-1 J"
    first, second = Known(1.0), Known(1.0)
    assert least_certified([first, second]) == "1 J" and first is not second


def _name(spline: Spline) -> str:
    return f"{spline.duration:g} s"


def incumbent_with(*splines: Spline) -> SearchState:
    """The state of a search with one candidate, given these motions one after the other."""
    run = prepared(problem(), clock=still)
    for spline in splines:
        result = SolveResult(
            SolveStatus.SOLVED, SolveReason.BASELINE, spline=spline, figures=(_name(spline),)
        )
        run.state.accept_if_better(
            run.state.candidates[0], result, run.state.prepared.energy(spline)
        )
    return run.state


def test_a_refused_motion_leaves_the_one_before_it() -> None:
    slow, faster, best = (quintic_spline(START, GOAL, duration) for duration in (9.0, 6.0, SLOW))
    state = incumbent_with(slow, faster, best)
    (candidate,) = state.candidates
    for spline in (best, faster, slow):
        assert candidate.spline is spline and _name(spline) in candidate.message
        assert candidate.energy == state.prepared.cost_of(spline)
        state.reject(candidate)
    assert (
        candidate.energy is None
        and candidate.attempt is None
        and candidate.status.value == "failed"
    )


def test_a_refused_candidate_takes_certified_motions_alone() -> None:
    state = incumbent_with(quintic_spline(START, GOAL, 9.0), quintic_spline(START, GOAL, 6.0))
    (candidate,) = state.candidates
    state.reject(candidate)
    best = quintic_spline(START, GOAL, SLOW)
    result, energy = (
        SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, spline=best),
        state.prepared.energy(best),
    )
    state.accept_if_better(candidate, result, energy)
    assert candidate.duration == 9.0
    state.accept_if_better(candidate, result, energy, certified=True)
    assert candidate.spline is best


def test_what_the_certificate_refuses_is_not_all_that_was_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """If the certificate refuses a motion, an earlier known motion is the answer.

    There is one candidate; without the known motion there would be no answer.
    """
    asked, known = problem(payload=PAYLOAD), quintic_spline(START, GOAL, SLOW)
    cost_of = PreparedProblem.of(asked).cost_of
    refused = list[float]()

    def judge(*given: Any) -> Certificate:
        honest = certify(*given)
        if cost_of(given[1]) < cost_of(known):
            refused.append(cost_of(given[1]))
            return replace(honest, start_error=(1.0, 0.0))
        return honest

    monkeypatch.setattr("joulepath.optimizer.search.state.certify", judge)
    found = Run(asked, [known]).solution()
    assert refused
    assert found.certificate.valid and found.energy.electrical.total == cost_of(known)


def own_kind(found: Solution, method: MethodName) -> list[float]:
    """Savings against feasible baselines in our duration, of kinds within the method's space."""
    kinds = METHODS[method].accepted_baselines
    feasible = [each for each in found.baselines if each.name in kinds and each.within_limits]
    same = [each for each in feasible if each.duration == pytest.approx(found.duration)]
    return [each.saving for each in same if each.saving is not None]


KINDS: dict[MethodName, tuple[str, ...]] = {
    "bspline": ("quintic", "ruckig", "ruckig_slowed"),
    "time_scaling": ("quintic",),
    "lagrange": ("quintic",),
    "uniform_scaling": ("ruckig", "ruckig_slowed"),
    "polynomial_ga": ("quintic",),
}


@pytest.mark.parametrize("method", long_but(["lagrange", "bspline"], KINDS))
def test_a_baseline_of_the_own_kind_is_the_answer_if_nothing_better_is_found(
    method: MethodName, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If a method finds nothing better, a baseline from its own space is the answer.

    Every solve of the method returns a motion worse than the baselines.
    """
    assert METHODS[method].accepted_baselines == KINDS[method]
    poor = _detour()

    def solve(self: Method, *_: Any, **__: Any) -> SolveResult:
        return SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, spline=poor)

    for name in ("solve", "solve_from"):
        monkeypatch.setattr(METHODS[method], name, solve)
    asked = problem(method=method, **fixed(SLOW))
    found = optimize(asked)
    assert found.certificate.valid
    assert found.energy.electrical.total < PreparedProblem.of(asked).cost_of(poor)
    assert own_kind(found, method) and min(own_kind(found, method)) >= -SLACK


def _detour() -> Spline:
    """A motion of SLOW [s] by way of a posture beside."""
    fine = Run(problem(**fixed(SLOW)), clock=still).solution().trajectory.spline
    points = fine.control_points.copy()
    middle = slice(len(points) // 2 - 1, len(points) // 2 + 2)
    points[middle] += np.array([0.5, 0.3, -0.3, 0.3, 0.3, 0.3])
    return lasting(replace(fine, control_points=points), SLOW)


def test_a_baseline_that_is_not_certified_in_time_is_not_feasible(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A baseline without a certificate in time is not reported as feasible.

    Its energy is below the answer's, so a feasible baseline would have to be the answer.
    """
    poor = _detour()
    for name in ("solve", "solve_from"):
        monkeypatch.setattr(
            METHODS["bspline"],
            name,
            lambda *_, **__: SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, spline=poor),
        )

    def late(*_: Any) -> Any:
        raise DeadlinePassed

    monkeypatch.setattr(baseline_comparison, "_accept_certified", late)
    found = optimize(problem(**fixed(SLOW)))
    (quintic,) = (each for each in found.baselines if each.name == "quintic")
    assert quintic.saving is None and quintic.reason == baseline_comparison.NOT_CONFIRMED
    assert quintic.electrical < found.energy.electrical.total
    assert all(each >= -SLACK for each in own_kind(found, "bspline"))


@pytest.mark.parametrize(
    "method", long_but(["bspline"], ["bspline", "time_scaling", "lagrange", "uniform_scaling"])
)
@pytest.mark.parametrize("readings", long_but([80, 400], range(20, 1000, 20)))
def test_wherever_the_deadline_ends_it_no_feasible_baseline_needs_less(
    method: MethodName, readings: int
) -> None:
    asked = problem(method=method, deadline=float(readings), payload=PAYLOAD, **fixed(SLOW))
    try:
        found = optimize(asked, CountingClock())
    except DeadlineExceeded:
        return
    assert found.certificate.valid
    assert all(each >= -SLACK for each in own_kind(found, method))
