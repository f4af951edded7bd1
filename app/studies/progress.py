"""Progress of a study: comparison of energies with the previous, the best and the threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One step. Changes [J] are negative if energy was saved; None at the first step."""

    change_from_last: float | None
    change_from_best: float | None
    threshold_met: bool


def step(energy: float, last: float | None, best: float | None, threshold: float) -> Progress:
    """The progress of one step of `energy` [J], from the previous energy and the least of all
    before; None: no step.
    """
    return Progress(
        change_from_last=None if last is None else energy - last,
        change_from_best=None if best is None else energy - best,
        threshold_met=energy <= threshold,
    )


def progress(energies: Sequence[float], threshold: float) -> list[Progress]:
    """The progress of all steps, from their energies [J]."""
    steps, last, best = [], None, None
    for energy in energies:
        steps.append(step(energy, last, best, threshold))
        last, best = energy, energy if best is None else min(best, energy)
    return steps
