"""Motions of moves that were found before, by what was asked: a cycle of which one stop has changed
does not solve its other moves again.

A motion is found again for exactly the same question only. So it changes no answer but the time
until it is there; and every motion of an answer is certified anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AnySet
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# how a motion was looked for: as the search of a cycle tries it, to the end, at a price of time, or
# for its duration
Stage = Literal["tried", "finished", "priced", "fastest"]
# fields of a problem on which its best motion does not hang
_ASIDE = ("arm", "sample_period", "deadline")


@dataclass(frozen=True)
class KnownMotion:
    """A motion, and the stationarity in which its optimisation ended."""

    spline: Spline
    stationarity: float | None

    @property
    def result(self) -> SolveResult:
        """The result of having solved for it."""
        return SolveResult(
            SolveStatus.SOLVED,
            SolveReason.CONVERGED,
            spline=self.spline,
            stationarity=self.stationarity,
        )


class KnownMotions:
    """Motions by the keys of the questions that they answer. `used` are those that were asked for
    or found since.
    """

    def __init__(self, before: Mapping[str, KnownMotion] | None = None) -> None:
        self._before = dict(before or {})
        self.used: dict[str, KnownMotion] = {}
        # a scene may be large: an arm is read once, and kept, so that no other one gets its id
        self._arms: dict[int, tuple[Arm, bytes]] = {}

    def recall(self, key: str) -> KnownMotion | None:
        """The motion that answers a question; None if none is known."""
        known = self.used.get(key) or self._before.get(key)
        if known is not None:
            self.used[key] = known
        return known

    def keep(self, key: str, motion: KnownMotion) -> None:
        """Keep the answer to a question: one that more time would not change."""
        self.used[key] = motion

    def forget(self, key: str) -> None:
        """Drop a motion that did not stand the test."""
        self._before.pop(key, None)
        self.used.pop(key, None)

    def key(self, stage: Stage, problem: Problem, *more: Any) -> str:
        """What tells a question from others: what is asked, and `more`; deadline and samples do not
        matter.
        """
        if id(problem.arm) not in self._arms:
            self._arms[id(problem.arm)] = problem.arm, _digest(problem.arm)
        own = {
            each.name: getattr(problem, each.name)
            for each in fields(problem)
            if each.name not in _ASIDE
        }
        return _digest([stage, self._arms[id(problem.arm)][1], own, more]).hex()


_in_use: ContextVar[KnownMotions | None] = ContextVar("known motions", default=None)


@contextmanager
def knowing(motions: KnownMotions) -> Iterator[None]:
    """Within the context, cycles use these motions, and add those that they find."""
    before = _in_use.set(motions)
    try:
        yield
    finally:
        _in_use.reset(before)


def known_motions() -> KnownMotions:
    """The motions in use; without any, none is known, and what is kept is lost."""
    return _in_use.get() or KnownMotions()


def _digest(value: Any) -> bytes:
    digest = hashlib.sha256()
    for part in _content(value):
        digest.update(part)
    return digest.digest()


def _content(value: Any) -> Iterator[bytes]:
    """Everything that a value is made of. Two values with the same content are the same
    question."""
    match value:
        case None | bool() | int() | float() | str() | bytes():
            yield repr(value).encode() + b";"
        case np.generic():
            # numbers that a caller took from an array
            yield from _content(value.item())
        case np.ndarray():
            yield (
                repr((value.dtype.str, value.shape)).encode()
                + np.ascontiguousarray(value).tobytes()
            )
        case pin.Model():
            yield value.saveToString().encode()
        case _ if is_dataclass(value):
            yield type(value).__qualname__.encode() + b"{"
            for each in fields(value):
                yield each.name.encode() + b"="
                yield from _content(getattr(value, each.name))
            yield b"}"
        case Mapping():
            yield b"{"
            for name in sorted(value, key=repr):
                yield from _content(name)
                yield from _content(value[name])
            yield b"}"
        case AnySet():
            yield from _content(sorted(map(repr, value)))
        case Sequence():
            yield b"["
            for each in value:
                yield from _content(each)
            yield b"]"
        case _:
            raise TypeError(f"a {type(value).__name__} tells no question from another")
