"""What a search tells while it runs: the number of its candidates, what became of those it tried,
the best so far.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from joulepath.models.robot import Array


@dataclass(frozen=True)
class CandidatesFound:
    """There are `total` candidates. There may be more later."""

    total: int


@dataclass(frozen=True)
class CandidateTried:
    """What became of the candidate of this index: the `energy` [J] of its motion, None without one.

    `pruned`: it was given up, since it comes to no less energy than the best motion. `bound` [J] is
    its proven lower bound, None if none is known.
    """

    index: int
    status: Literal["solved", "pruned", "failed"]
    bound: float | None
    energy: float | None


@dataclass(frozen=True, eq=False)
class Improved:
    """The best answer so far: its `energy` [J], its `duration` [s], and `q_goal` (nq,) [rad] in
    which it ends.

    No answer needs less than `bound` [J]. None stands for what is not known yet, or what the answer
    does not have.
    """

    energy: float
    duration: float | None = None
    bound: float | None = None
    q_goal: Array | None = None


Event = CandidatesFound | CandidateTried | Improved
Tell = Callable[[Event], None]


def nobody(event: Event) -> None:
    """Listens to a search that nobody listens to."""


class Forward:
    """Passes on what is news: no number falls, no energy rises, no candidate comes twice."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._total = -1
        self._tried = set[int]()
        self._best: Improved | None = None

    def __call__(self, event: Event) -> None:
        """Passes the event on, if it is news."""
        if isinstance(event, CandidatesFound):
            if event.total <= self._total:
                return
            self._total = event.total
        elif isinstance(event, CandidateTried):
            if event.index in self._tried:
                return
            self._tried.add(event.index)
        else:
            best = _better(event, self._best)
            if best is self._best:
                return
            self._best = event = best
        self._tell(event)


def forward(tell: Tell) -> Tell:
    """What passes on to `tell` what is news."""
    return tell if tell is nobody else Forward(tell)


def only_improved(tell: Tell) -> Tell:
    """What passes on to `tell` the best answers alone, of a search whose bound does not hold for
    all of them.
    """

    def passed(event: Event) -> None:
        if isinstance(event, Improved):
            tell(replace(event, bound=None))

    return nobody if tell is nobody else passed


def _better(event: Improved, known: Improved | None) -> Improved:
    """What is known after an event: `known` itself if nothing is better."""
    if known is None:
        return event
    bounds = [each.bound for each in (known, event) if each.bound is not None]
    bound = max(bounds, default=None)
    if event.energy < known.energy:
        return replace(event, bound=bound)
    return known if bound == known.bound else replace(known, bound=bound)
