"""The QP of a step against every limit on rates, by a prediction of its own."""

from __future__ import annotations

import numpy as np

from optimizer.nlp.nonlinear_program import FEASIBILITY
from optimizer.nlp.working_set_qp import MOST_ROUNDS, NEAR, QPInputs, WorkingSetQP
from tests.optimizer.moves import GOAL, START
from tests.optimizer.nlp.test_sqp import program, quintic, shortest


def test_a_step_breaks_no_limit_on_the_other_side() -> None:
    """Of motions near their limits on one side, steps far to the other: linear predictions keep every limit."""
    duration = 2.5 * shortest(START, GOAL)
    p = program(START, GOAL, duration_max=duration, duration_min=duration)
    rng = np.random.default_rng(7)
    turned = 0
    for _ in range(20):
        free, noise = quintic(p), rng.normal(size=(p.free_count, p.r))
        qp = WorkingSetQP(p, duration)
        rates = qp.rates(duration)[:, :, None]
        scale = 0.5
        while np.abs(p.kinematics(free + scale * noise) / rates).max() > 0.95:
            scale *= 0.9
        free = free + scale * noise
        ratio = p.kinematics(free) / rates
        one = np.eye(qp.n)
        line = p.derivatives(free, duration, np.zeros((len(p.basis.nodes), p.kernel.nq)))
        values = p.path_rows.values(p.points(free), duration)
        inputs = QPInputs(one.dot, one, rng.normal(size=qp.n), free, duration, line, values, ratio)
        step = qp.solve(inputs, MOST_ROUNDS)
        assert step is not None
        assert not step.relaxed
        after = p.kinematics(free + step.x.reshape(free.shape)) / rates
        assert np.abs(after).max() <= 1 + FEASIBILITY
        turned += int(((np.abs(ratio) > NEAR) & (-np.sign(ratio) * after > 0.99)).any())
    assert turned
