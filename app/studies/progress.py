"""Progress of a study: each energy compared with the previous one, the best so far, and the threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One step. Changes [J] are negative if energy was saved; None at the first step."""

    change_from_last: float | None
    change_from_best: float | None
    threshold_met: bool


def progress(energies: Sequence[float], threshold: float) -> list[Progress]:
    """The progress of each step, from the energies [J] of all steps."""
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
    """Index of the least energy, the first of equals; None for an empty sequence."""
    return min(range(len(energies)), key=energies.__getitem__, default=None)


def first_met(energies: Sequence[float], threshold: float) -> int | None:
    """Index of the first energy of at most `threshold` [J]; None if there is none."""
    return next((k for k, energy in enumerate(energies) if energy <= threshold), None)
