"""The answers of the routes under `/studies`, from the rows of the database."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from pydantic_core import to_jsonable_python

from joulepath.app.engine.result import csv_document
from joulepath.app.schemas import studies as schemas
from joulepath.app.store.studies import Entry, History, State, energy_of
from joulepath.app.store.tables import Iteration, Study

_COLUMNS = {
    "number": "iteration",
    "created": "created",
    "kind": "kind",
    "energy": "energy_J",
    "electrical": "electrical_J",
    "mechanical": "mechanical_J",
    "duration": "duration_s",
    "change_from_last": "change_from_last_J",
    "change_from_best": "change_from_best_J",
    "threshold_met": "threshold_met",
    "answer": "answer",
}
_OF_STUDY = ("id", "name", "robot", "figures", "objective", "threshold", "created", "owner")


def summary(state: State) -> dict[str, Any]:
    """Fields of a StudySummary."""
    study, last = state.study, state.last
    met_by = None if last is None else last.met_by
    return {
        **{name: getattr(study, name) for name in _OF_STUDY},
        "iterations": 0 if last is None else last.number,
        "last": None if last is None else _reached(study, last),
        "best": None if state.best is None else _reached(study, state.best),
        "threshold_met": met_by is not None,
        "threshold_met_by": met_by,
    }


def full(history: History) -> dict[str, Any]:
    """Fields of a Study."""
    return {**summary(history.state), "history": entries(history)}


def entries(history: History) -> list[dict[str, Any]]:
    """Fields of an Iteration for every entry."""
    study = history.state.study
    energies = [energy_of(study, iteration) for iteration in history.iterations]
    return [
        {**_columns_of(iteration), "energy": energy, **asdict(made)}
        for iteration, energy, made in zip(
            history.iterations, energies, progress(energies, study.threshold), strict=True
        )
    ]


def detail(entry: Entry) -> schemas.IterationDetail:
    """One iteration, and the state of its study after it."""
    study, iteration = entry.study, entry.iteration
    energy, last, best = (
        None if each is None else energy_of(study, each)
        for each in (iteration, entry.before, entry.best_before)
    )
    assert energy is not None
    return schemas.IterationDetail(
        **_columns_of(iteration),
        energy=energy,
        **asdict(step(energy, last, best, study.threshold)),
        request={iteration.kind: iteration.request},
        best=_reached(study, entry.best),
        threshold=study.threshold,
        threshold_met_by=iteration.met_by,
    )


def as_csv(history: History) -> bytes:
    """The history as CSV, one line per iteration; a null value is an empty cell."""
    rows: list[Iterable[Any]] = [_COLUMNS.values()]
    for entry in entries(history):
        row = entry | {
            "created": to_jsonable_python(entry["created"]),
            "threshold_met": "true" if entry["threshold_met"] else "false",
        }
        rows.append([row[name] for name in _COLUMNS])
    return csv_document(rows)


def _columns_of(iteration: Iteration) -> dict[str, Any]:
    names = ("number", "kind", "created", "electrical", "mechanical", "duration")
    return {name: getattr(iteration, name) for name in names} | {"answer": iteration.answer_id}


def _reached(study: Study, iteration: Iteration) -> schemas.IterationEnergy:
    return schemas.IterationEnergy(number=iteration.number, energy=energy_of(study, iteration))


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
