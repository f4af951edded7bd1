"""The QP of a step, compared with predictions of all rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.qp_data import QPInputs
from joulepath.optimizer.solve.nlp.qp_rows import QP_ROWS, ProgramRows
from joulepath.optimizer.solve.nlp.working_set_qp import WORKING_SET, WorkingSetQP
from tests.optimizer.moves import GOAL, START
from tests.optimizer.solve.nlp.test_sqp import program, quintic, shortest

# tolerance of promised decreases of about 0.1 by DAQP
PROMISE_TOLERANCE = 1e-8


def of_duration(share: float) -> NonlinearProgram:
    """The program of a move with a fixed duration, as a share of the shortest."""
    duration = share * shortest(START, GOAL)
    return program(START, GOAL, duration_max=duration, duration_min=duration)


def inputs_at(
    p: NonlinearProgram, qp: WorkingSetQP, free: Array, rng: np.random.Generator
) -> QPInputs:
    """A QP at free control points (m, r) with Hessian 1 and a random gradient."""
    one, duration = np.eye(qp.n), qp.time_scale
    line = p.derivatives(free, duration, np.zeros((len(p.basis.nodes), p.kernel.nq)))
    values = p.path_rows.values(p.points(free), duration)
    rates = qp.rates(duration)
    ratio = p.kinematics(free) / rates[:, :, None]
    return QPInputs(one.dot, one, rng.normal(size=qp.n), free, duration, line, values, rates, ratio)


def test_a_step_breaks_no_limit_on_the_other_side() -> None:
    """Steps from near one limit far to the opposite limit: linear predictions keep all limits."""
    p = of_duration(2.5)
    rng = np.random.default_rng(7)
    turned = 0
    for _ in range(20):
        free, noise = quintic(p), rng.normal(size=(p.free_count, p.r))
        qp = WorkingSetQP(p, p.t_max)
        rates = qp.rates(p.t_max)[:, :, None]
        scale = 0.5
        while np.abs(p.kinematics(free + scale * noise) / rates).max() > 0.95:
            scale *= 0.9
        free = free + scale * noise
        inputs = inputs_at(p, qp, free, rng)
        ratio, step = inputs.ratio, qp.solve(inputs, WORKING_SET.max_rounds)
        assert step is not None
        assert not step.relaxed
        after = p.kinematics(free + step.x.reshape(free.shape)) / rates
        assert np.abs(after).max() <= 1 + FEASIBILITY
        near = np.abs(ratio) > WORKING_SET.near_rate
        turned += int((near & (-np.sign(ratio) * after > 0.99)).any())
    assert turned


@pytest.mark.parametrize("share", [0.5, 0.9, 2.5])
def test_no_limit_has_two_rows(share: float) -> None:
    """A relaxed step, too, violates only limits with a row."""
    p = of_duration(share)
    rng = np.random.default_rng(8)
    for _ in range(10):
        qp = WorkingSetQP(p, p.t_max)
        step = qp.solve(
            inputs_at(p, qp, quintic(p) + 0.05 * rng.normal(size=(p.free_count, p.r)), rng),
            WORKING_SET.max_rounds,
        )
        assert step is not None and (share > 1 or step.relaxed)
        # the lower and the upper one of a point
        assert np.unique(np.array(step.places), axis=1, return_counts=True)[1].max() <= 2


def test_further_constraints_let_a_step_promise_less() -> None:
    """A QP ends with its first solution exactly if this solution promises too little."""
    p = of_duration(1.2)
    rng = np.random.default_rng(9)
    ended = 0
    for _ in range(20):
        free = quintic(p) + 0.02 * rng.normal(size=(p.free_count, p.r))
        inputs = inputs_at(p, WorkingSetQP(p, p.t_max), free, rng)
        # a short enough step, so that no bound shortens it
        inputs = replace(inputs, gradient=0.1 * inputs.gradient)

        def promised(rounds: int, enough: float = -np.inf, inputs: QPInputs = inputs) -> float:
            step = WorkingSetQP(p, p.t_max).solve(inputs, rounds, enough)
            assert step is not None and not step.relaxed
            return -float(inputs.gradient @ step.x) - 0.5 * float(step.x @ inputs.hessian(step.x))

        most = WORKING_SET.max_rounds
        first, last = promised(1), promised(most)
        assert last <= first + PROMISE_TOLERANCE
        assert promised(most, enough=last - PROMISE_TOLERANCE) == pytest.approx(
            last, abs=PROMISE_TOLERANCE
        )
        assert promised(most, enough=first + PROMISE_TOLERANCE) == pytest.approx(
            first, abs=PROMISE_TOLERANCE
        )
        ended += last < 0.9 * first
    assert ended


def test_rows_added_one_by_one_are_those_added_at_once() -> None:
    """Several times the initial number of rows; half of the rows before a first solve."""
    rng, n, count = np.random.default_rng(6), 12, 3 * QP_ROWS.initial_rows
    A, most, gradient = (
        rng.normal(size=(count, n)),
        rng.uniform(0.05, 1.0, count),
        rng.normal(size=n),
    )
    at_once, one_by_one = (ProgramRows(np.eye(n), (3, 1, 1)) for _ in range(2))
    at_once.add(A, most)
    for k in range(count):
        if k == count // 2:
            one_by_one.solve(gradient, relax=False)
        assert one_by_one.add(A[k : k + 1], most[k : k + 1]) == [k]
    (y, price, found), (others, _, other_found) = (
        rows.solve(gradient, relax=False) for rows in (at_once, one_by_one)
    )
    assert found and other_found
    assert others == pytest.approx(y, abs=PROMISE_TOLERANCE)
    assert (A @ y <= most + PROMISE_TOLERANCE).all() and (price >= 0).all()
    assert y == pytest.approx(-gradient - price @ A, abs=PROMISE_TOLERANCE)
