"""When an answer may be called `optimal`."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.result.energy import Objective


@dataclass(frozen=True)
class Claims:
    """What an answer must prove before it is called `optimal`."""

    mechanical_gap: float = 0.01
    """Greatest proven gap of mechanical work, (work − lower bound) / work.

    A motion has many local optima of mechanical work. Of 47 answers whose other candidates were all
    ruled out or solved, 25 were more than 0.5 % above the best motion known and one was 13 % above
    it, so that convergence alone proves nothing. Electrical energy has hardly any local optima that
    matter: there, it is enough that the solver has converged and that bounds rule out every
    candidate that was not solved.
    """


CLAIMS = Claims()


def may_be_optimal(
    objective: Objective, energy: float, lower_bound: float, claims: Claims = CLAIMS
) -> bool:
    """Whether the gap between an energy [J] and its lower bound [J] is small enough for the word
    `optimal`.
    """
    return objective == "electrical" or energy - lower_bound <= claims.mechanical_gap * abs(energy)
