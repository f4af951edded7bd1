"""Progress of a search: number and outcomes of its candidates, and the best answer so far; and of
other computations: number of their steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from joulepath.models.robot import Array

T = TypeVar("T")


@dataclass(frozen=True)
class CandidatesFound:
    """Number of candidates; more may follow later."""

    total: int


@dataclass(frozen=True)
class CandidateTried:
    """Outcome of a candidate.

    Attributes:
        index: number of the candidate.
        status: `solved`, `failed`, or `pruned` if it cannot need less energy than the best motion.
        bound: proven lower bound [J]; None if unknown.
        energy: objective of its motion [J]; None without a motion.
    """

    index: int
    status: Literal["solved", "pruned", "failed"]
    bound: float | None
    energy: float | None


@dataclass(frozen=True, eq=False)
class Improved:
    """Best answer so far. None stands for an unknown value.

    Attributes:
        energy: objective [J].
        duration: duration [s].
        bound: lower bound for all answers [J].
        q_goal: configuration at the goal, shape (nq,) [rad].
    """

    energy: float
    duration: float | None = None
    bound: float | None = None
    q_goal: Array | None = None


@dataclass(frozen=True)
class StepsDone:
    """Steps of a computation without a search.

    Attributes:
        done: number of completed steps; for a simulated motion, the completed time [s].
        total: number of all steps; None if unknown.
        name: name of the steps, in the plural.
    """

    done: float
    total: float | None
    name: str


Event = CandidatesFound | CandidateTried | Improved
Told = Event | StepsDone
Tell = Callable[[Event], None]
TellSteps = Callable[[StepsDone], None]


def no_listener(event: Told) -> None:
    """No-op listener."""


class Steps:
    """Counts the steps of a computation, and reports every step.

    Args:
        name: name of the steps, in the plural.
        total: number of all steps; None if unknown.
        tell: listener.
    """

    def __init__(self, name: str, total: float | None, tell: TellSteps) -> None:
        self._name, self._total, self._tell = name, total, tell
        self._done = 0.0
        self.add(0.0)

    def add(self, steps: float = 1.0) -> None:
        """Count steps as done."""
        self._done += steps
        self._tell(StepsDone(self._done, self._total, self._name))

    def each(self, items: Iterable[T]) -> Iterator[T]:
        """Yield items as steps. A step is complete when the next item is requested."""
        for item in items:
            yield item
            self.add()


class NewsFilter:
    """Passes on events with news: more candidates, new candidates, less energy or a higher
    bound.
    """

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._total = -1
        self._tried = set[int]()
        self._best: Improved | None = None

    def __call__(self, event: Event) -> None:
        """Pass the event on if it has news."""
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


def only_news(tell: Tell) -> Tell:
    """Listener to pass on only events with news to `tell`."""
    return tell if tell is no_listener else NewsFilter(tell)


def only_improved(tell: Tell) -> Tell:
    """Listener to pass on only the best answers to `tell`, without bounds.

    Used for a search with a bound on a part of the answers only.
    """

    def passed(event: Event) -> None:
        if isinstance(event, Improved):
            tell(replace(event, bound=None))

    return no_listener if tell is no_listener else passed


def _better(event: Improved, known: Improved | None) -> Improved:
    """The best answer after an event; the very object `known` if nothing is better."""
    if known is None:
        return event
    bounds = [each.bound for each in (known, event) if each.bound is not None]
    bound = max(bounds, default=None)
    if event.energy < known.energy:
        return replace(event, bound=bound)
    return known if bound == known.bound else replace(known, bound=bound)
