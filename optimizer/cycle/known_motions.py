"""Memo of the motions found for problems: a changed cycle solves its changed moves only.

A motion is recalled only for exactly the same problem. The memo thus reduces the computing time
without a change of the answers. Every motion of an answer is certified anew.
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

# kind of motion: first solve, converged, least energy at a price of time, or fastest
Stage = Literal["tried", "finished", "priced", "fastest"]
# fields of a problem without influence on its best motion
_IGNORED_FIELDS = ("arm", "sample_period", "deadline")


@dataclass(frozen=True)
class KnownMotion:
    """A motion, and its stationarity at the end of the optimisation."""

    spline: Spline
    stationarity: float | None

    @property
    def result(self) -> SolveResult:
        """The motion as the result of a converged solve."""
        return SolveResult(
            SolveStatus.SOLVED,
            SolveReason.CONVERGED,
            spline=self.spline,
            stationarity=self.stationarity,
        )


class KnownMotions:
    """Motions by the keys of their problems; `used` has all motions recalled or added so far."""

    def __init__(self, before: Mapping[str, KnownMotion] | None = None) -> None:
        self._before = dict(before or {})
        self.used: dict[str, KnownMotion] = {}
        # hashing a large scene takes long: every arm is hashed once
        self._arms: list[tuple[Arm, bytes]] = []

    def recall(self, key: str) -> KnownMotion | None:
        """Motion for a key; None for an unknown key."""
        known = self.used.get(key) or self._before.get(key)
        if known is not None:
            self.used[key] = known
        return known

    def keep(self, key: str, motion: KnownMotion) -> None:
        """Store a converged motion, which more time would not improve."""
        self.used[key] = motion

    def forget(self, key: str) -> None:
        """Remove a motion after a failed certificate."""
        self._before.pop(key, None)
        self.used.pop(key, None)

    def _digest_of(self, arm: Arm) -> bytes:
        known = next((digest for other, digest in self._arms if other is arm), None)
        if known is None:
            known = _digest(arm)
            self._arms.append((arm, known))
        return known

    def key(self, stage: Stage, problem: Problem, *more: Any) -> str:
        """Key of a problem.

        Args:
            stage: kind of the motion.
            problem: problem to be solved; the key disregards its deadline and sample period.
            more: further values that distinguish problems.
        """
        own = {
            each.name: getattr(problem, each.name)
            for each in fields(problem)
            if each.name not in _IGNORED_FIELDS
        }
        return _digest([stage, self._digest_of(problem.arm), own, more]).hex()


_in_use: ContextVar[KnownMotions | None] = ContextVar("known motions", default=None)


def knowing(motions: KnownMotions) -> AbstractContextManager[None]:
    """Context for cycles that recall and store motions in the given memo."""
    return assigned(_in_use, motions)


def known_motions() -> KnownMotions:
    """The memo of the context; a new, empty memo outside of any context."""
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
    """Bytes of a value and of all its parts; they differ for different problems."""
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
            # most data of an arm are the figures of its robot, which many arms share
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
