"""How a study comes along: each step's energy against the one before, the best so far and the threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One step. Changes are in J, below zero where energy was saved; None at the first step."""

    change_from_last: float | None
    change_from_best: float | None
    threshold_met: bool


def progress(energies: Sequence[float], threshold: float) -> list[Progress]:
    """Of each energy [J] against those before it."""
    steps, best = [], None
    for k, energy in enumerate(energies):
        steps.append(
            Progress(
                change_from_last=energy - energies[k - 1] if k else None,
                change_from_best=None if best is None else energy - best,
                threshold_met=energy <= threshold,
            )
        )
        best = energy if best is None else min(best, energy)
    return steps


def best_of(energies: Sequence[float]) -> int | None:
    """Index of the least energy, the first of several; None if there is none."""
    return min(range(len(energies)), key=energies.__getitem__, default=None)


def first_met(energies: Sequence[float], threshold: float) -> int | None:
    """Index of the first energy that meets the threshold; None if none does."""
    return next((k for k, energy in enumerate(energies) if energy <= threshold), None)
