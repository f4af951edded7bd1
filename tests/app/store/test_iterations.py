"""Iterations of a study keep the best so far and the first below the threshold, at any length."""

from __future__ import annotations

from functools import partial

import pytest
from sqlalchemy import event

from joulepath.app.access.client import OPERATOR
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.store import studies
from joulepath.app.store.store import Store
from joulepath.app.store.studies import Step
from joulepath.app.store.tables import Iteration, Study, new_id
from joulepath.app.studies.answers import detail, entries

pytestmark = pytest.mark.parametrize("url", ["sqlite"], indirect=True)
ENERGIES = [100.0, 80.0, 90.0, 60.0, 60.0, 70.0]
THRESHOLD = 80.0
BEST = [1, 2, 2, 4, 4, 4]
MET_BY = [None, 2, 2, 2, 2, 2]


def step(energy: float) -> Step:
    answer = StoredAnswer(new_id(), b"{}")
    return Step(
        "optimize",
        {"energy": energy},
        answer,
        duration=1.0,
        electrical=energy,
        mechanical=1000.0 - energy,
    )


async def begun(store: Store, objective: str = "electrical", count: int = len(ENERGIES)) -> Study:
    study = studies.new_study("A study", "ur5e", objective, THRESHOLD, None, None)
    await store.write(partial(studies.create, study=study))
    for energy in ENERGIES[:count]:
        await store.write(
            partial(studies.add, study_id=study.id, step=step(energy), key=None, client=OPERATOR)
        )
    return study


async def test_each_knows_the_best_so_far(store: Store) -> None:
    study = await begun(store)
    found = [
        detail(await store.read(partial(studies.entry, study_id=study.id, number=number)))
        for number in range(1, len(ENERGIES) + 1)
    ]
    assert [each.best.number for each in found] == BEST
    assert [each.threshold_met_by for each in found] == MET_BY
    assert [each.request["optimize"] for each in found] == [
        {"energy": energy} for energy in ENERGIES
    ]
    state = await store.read(partial(studies.state, study_id=study.id))
    best, last = state.best, state.last
    assert best is not None and last is not None
    assert (best.number, last.number, last.met_by) == (4, 6, 2)
    # added one at a time, or all at once, with the same outcome
    history = entries(await store.read(partial(studies.history, study_id=study.id)))
    assert [
        entry.items() <= each.model_dump().items()
        for entry, each in zip(history, found, strict=True)
    ] == [True] * len(ENERGIES)


async def test_the_objective_is_what_is_compared(store: Store) -> None:
    study = await begun(store, "mechanical")
    state = await store.read(partial(studies.state, study_id=study.id))
    assert (state.best.number, state.last.met_by) == (1, None)  # type: ignore[union-attr]


@pytest.mark.parametrize("count", [3, 6])
async def test_to_add_one_reads_as_much_in_a_study_of_any_length(count: int, store: Store) -> None:
    read: list[Iteration] = []

    def note(iteration: Iteration, _: object) -> None:
        read.append(iteration)

    study = await begun(store, count=count)
    event.listen(Iteration, "load", note)
    try:
        number, _ = await store.write(
            partial(studies.add, study_id=study.id, step=step(50.0), key=None, client=OPERATOR)
        )
        assert len(read) == 2, "the last one and the best one"
        await store.read(partial(studies.entry, study_id=study.id, number=number))
        assert len(read) == 2 + 3, "it, the one before, and the best one before"
    finally:
        event.remove(Iteration, "load", note)
