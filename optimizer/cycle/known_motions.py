"""Memo of found motions by their problems, so that a changed cycle solves only its changed moves.

A motion is found again for exactly the same question only. The memo thus changes the computing time
but no answer, and every motion of an answer is certified anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AnySet
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import MOST_ROBOTS, Robot
from joulepath.optimizer.context_value import assigned
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# question that a motion answers: first motion, converged motion, at a price of time, or fastest
Stage = Literal["tried", "finished", "priced", "fastest"]
# fields of a problem without influence on its best motion
_IGNORED_FIELDS = ("arm", "sample_period", "deadline")


@dataclass(frozen=True)
class KnownMotion:
    """A motion, with the stationarity at the end of its optimisation."""

    spline: Spline
    stationarity: float | None

    @property
    def result(self) -> SolveResult:
        """The result of a solve that ended in this motion."""
        return SolveResult(
            SolveStatus.SOLVED,
            SolveReason.CONVERGED,
            spline=self.spline,
            stationarity=self.stationarity,
        )


class KnownMotions:
    """Motions by the keys of their questions; `used` has the motions recalled or found since."""

    def __init__(self, before: Mapping[str, KnownMotion] | None = None) -> None:
        self._before = dict(before or {})
        self.used: dict[str, KnownMotion] = {}
        # a scene may be large: every arm is read once
        self._arms: list[tuple[Arm, bytes]] = []

    def recall(self, key: str) -> KnownMotion | None:
        """Motion for a key; None if none is known."""
        known = self.used.get(key) or self._before.get(key)
        if known is not None:
            self.used[key] = known
        return known

    def keep(self, key: str, motion: KnownMotion) -> None:
        """Store a motion that more time would not improve."""
        self.used[key] = motion

    def forget(self, key: str) -> None:
        """Drop a motion that failed its certificate."""
        self._before.pop(key, None)
        self.used.pop(key, None)

    def _digest_of(self, arm: Arm) -> bytes:
        known = next((digest for other, digest in self._arms if other is arm), None)
        if known is None:
            known = _digest(arm)
            self._arms.append((arm, known))
        return known

    def key(self, stage: Stage, problem: Problem, *more: Any) -> str:
        """Key of a question.

        Args:
            stage: kind of the question.
            problem: problem to be solved; its deadline and sample period do not matter.
            more: further values that distinguish questions.
        """
        own = {
            each.name: getattr(problem, each.name)
            for each in fields(problem)
            if each.name not in _IGNORED_FIELDS
        }
        return _digest([stage, self._digest_of(problem.arm), own, more]).hex()


_in_use: ContextVar[KnownMotions | None] = ContextVar("known motions", default=None)


def knowing(motions: KnownMotions) -> AbstractContextManager[None]:
    """Context in which cycles recall and store motions."""
    return assigned(_in_use, motions)


def known_motions() -> KnownMotions:
    """The motions of the context; outside any context a new, empty memo."""
    return _in_use.get() or KnownMotions()


def _digest(value: Any) -> bytes:
    digest = hashlib.sha256()
    for part in _content(value):
        digest.update(part)
    return digest.digest()


@lru_cache(MOST_ROBOTS)
def _digest_of_robot(robot: Robot) -> bytes:
    return hashlib.sha256(b"".join(_content_of_fields(robot))).digest()


def _content_of_fields(value: Any) -> Iterator[bytes]:
    """Bytes of a dataclass."""
    yield type(value).__qualname__.encode() + b"{"
    for each in fields(value):
        yield each.name.encode() + b"="
        yield from _content(getattr(value, each.name))
    yield b"}"


def _content(value: Any) -> Iterator[bytes]:
    """Bytes of everything a value consists of; equal for equal questions only."""
    match value:
        case None | bool() | int() | float() | str() | bytes():
            yield repr(value).encode() + b";"
        case np.generic():
            # scalars taken from an array
            yield from _content(value.item())
        case np.ndarray():
            yield (
                repr((value.dtype.str, value.shape)).encode()
                + np.ascontiguousarray(value).tobytes()
            )
        case pin.Model():
            yield value.saveToString().encode()
        case Robot():
            # the figures of a robot are by far the most of an arm, and many arms share them
            yield _digest_of_robot(value)
        case _ if is_dataclass(value):
            yield from _content_of_fields(value)
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
