"""The certificate decides whether a motion is answered."""

from __future__ import annotations

from joulepath.optimizer.result.solution import Solution


def certified(solution: Solution) -> Solution:
    """The solution. Raises AssertionError if its certificate is not valid: the optimizer returns
    certified motions.
    """
    if not solution.certificate.valid:
        raise AssertionError(
            f"The certificate of the optimizer's motion is not valid: {solution.certificate}"
        )
    return solution
