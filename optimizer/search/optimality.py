"""The condition under which an answer is called `optimal`."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.result.energy import Objective


@dataclass(frozen=True)
class OptimalitySettings:
    """Settings of the condition under which an answer is called `optimal`."""

    mechanical_gap: float = 0.01
    """Greatest `optimality_gap` of mechanical work.

    A motion has many local optima of mechanical work. Of 47 answers whose other candidates were all
    ruled out or solved, 25 were more than 0.5 % above the best motion known and one was 13 % above
    it, so convergence alone proves nothing. Electrical energy has hardly any local optima that
    matter: it suffices that the solver converges and that bounds rule out all other candidates.
    """


OPTIMALITY = OptimalitySettings()


def may_be_optimal(
    objective: Objective,
    energy: float,
    lower_bound: float,
    settings: OptimalitySettings = OPTIMALITY,
) -> bool:
    """Whether the gap between an energy and its lower bound allows the word `optimal`.

    Args:
        objective: the objective.
        energy: objective of the answer [J].
        lower_bound: lower bound of all motions [J].
        settings: settings of the condition.
    """
    if objective == "electrical":
        return True
    return energy <= (1 + settings.mechanical_gap) * lower_bound
