"""The curvature of what an NLP holds against second differences of its cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.passing import Passing
from joulepath.optimizer.solve.nlp.sliding_ends import Slide
from tests.optimizer.dynamics.kernel_states import places

# duration [s], and length of a step
DURATION, STEP = 2.0, 1e-3


def without_dry_friction(program: NonlinearProgram) -> NonlinearProgram:
    """The program of an arm whose friction has no step: the Hessian leaves out what its reversal
    makes concave.
    """
    p = program.p.copy()
    p[places("coulomb", program.kernel.nq)] = 0.0
    return replace(program, p=p)


def assert_curvature(
    own: NonlinearProgram,
    free: Array,
    at: Passing | Slide,
    put: Callable[[Array], Array],
    drifted: Callable[[Array, Array], float],
    steps: Sequence[Array],
    relative: float,
) -> None:
    """Second differences of the cost of motions that are `put` back on what is held at `free` after
    each of the `steps` (m, r), of length 1, which keep it to first order.

    `drifted` is what the cost changes by to first order, for its gradient and the drift (m, r)
    along what is held that putting back makes.
    """
    line = own.derivatives(free, DURATION, np.zeros((len(own.basis.nodes), own.r)))
    gradient = line.gradient[:-1].reshape(free.shape)
    # a cost whose gradient along what is held is zero: else how a step is put back counts, too
    hessian = line.hessian[:-1, :-1] + at.curvature(gradient, free.size)
    for step in steps:
        sides = [put(free + sign * STEP * step) for sign in (-1, 1)]
        along = drifted(gradient, sum(sides) - 2 * free)
        second = sum(own.value(each, DURATION)[0] for each in sides) - 2 * line.cost - along
        exact = float(step.ravel() @ hessian @ step.ravel()) * STEP * STEP
        assert second == pytest.approx(exact, rel=relative, abs=1e-9 * abs(line.cost))
