"""Curvature of the equations of an NLP, compared with second differences of the cost."""

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

# duration of the motions [s]
DURATION = 2.0
# length of a step of the differences
EPS = 1e-3


def without_dry_friction(program: NonlinearProgram) -> NonlinearProgram:
    """The program without dry friction, since the Hessian omits its concave reversal."""
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
    """Compare the Hessian of cost and equations with second differences of the cost.

    Args:
        own: the NLP.
        free: free control points that meet the equations, shape (m, r).
        at: the equations at these points.
        put: puts free control points back on the equations.
        drifted: change of the cost to first order, for its gradient and the drift (m, r) along the
            equations made by `put`.
        steps: steps (m, r) of length 1 that meet the equations to first order.
        relative: relative tolerance.
    """
    line = own.derivatives(free, DURATION, np.zeros((len(own.basis.nodes), own.r)))
    gradient = line.gradient[:-1].reshape(free.shape)
    # with the gradient along the equations taken out, the way of putting back does not matter
    hessian = line.hessian[:-1, :-1] + at.curvature(gradient, free.size)
    for step in steps:
        sides = [put(free + sign * EPS * step) for sign in (-1, 1)]
        along = drifted(gradient, sum(sides) - 2 * free)
        second = sum(own.value(each, DURATION)[0] for each in sides) - 2 * line.cost - along
        exact = float(step.ravel() @ hessian @ step.ravel()) * EPS * EPS
        assert second == pytest.approx(exact, rel=relative, abs=1e-9 * abs(line.cost))
