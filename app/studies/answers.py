"""The answers of the routes under `/studies`, from the rows of the database."""

from __future__ import annotations

import csv
from dataclasses import asdict
from io import StringIO
from typing import Any

from app.schemas import studies as schemas
from app.store.studies import History
from app.store.tables import Iteration
from app.studies.progress import best_of, first_met, progress

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
_OF_STUDY = ("id", "name", "robot", "objective", "threshold", "created", "owner")


def summary(history: History) -> dict[str, Any]:
    """Fields of a StudySummary."""
    study, energies = history.study, history.energies
    met = first_met(energies, study.threshold)
    return {
        **{name: getattr(study, name) for name in _OF_STUDY},
        "iterations": len(energies),
        "last": _reached(history, len(energies) - 1 if energies else None),
        "best": _reached(history, best_of(energies)),
        "threshold_met": met is not None,
        "threshold_met_by": None if met is None else history.iterations[met].number,
    }


def full(history: History) -> dict[str, Any]:
    """Fields of a Study."""
    return {**summary(history), "history": entries(history)}


def entries(history: History) -> list[dict[str, Any]]:
    """Fields of an Iteration, for each."""
    steps = progress(history.energies, history.study.threshold)
    return [
        {**_columns_of(iteration), "energy": energy, **asdict(step)}
        for iteration, energy, step in zip(history.iterations, history.energies, steps, strict=True)
    ]


def detail(history: History) -> schemas.IterationDetail:
    """The last iteration of a history. That iteration must have its request loaded."""
    last, so_far = history.iterations[-1], summary(history)
    return schemas.IterationDetail(
        **entries(history)[-1],
        request={last.kind: last.request},
        **{name: so_far[name] for name in ("best", "threshold", "threshold_met_by")},
    )


def as_csv(history: History) -> str:
    """The history as CSV, one line per iteration; a null value is an empty cell."""
    text = StringIO()
    writer = csv.DictWriter(text, _COLUMNS.values(), lineterminator="\n")
    writer.writeheader()
    for entry in entries(history):
        row = entry | {
            "created": entry["created"].isoformat(),
            "threshold_met": "true" if entry["threshold_met"] else "false",
        }
        writer.writerow({column: row[name] for name, column in _COLUMNS.items()})
    return text.getvalue()


def _columns_of(iteration: Iteration) -> dict[str, Any]:
    names = ("number", "kind", "created", "electrical", "mechanical", "duration")
    return {name: getattr(iteration, name) for name in names} | {"answer": iteration.answer_id}


def _reached(history: History, index: int | None) -> schemas.IterationEnergy | None:
    if index is None:
        return None
    return schemas.IterationEnergy(number=history.iterations[index].number, energy=history.energies[index])
