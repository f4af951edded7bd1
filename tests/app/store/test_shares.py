"""Clients share what the database may hold, and choose their idempotency keys independently."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from joulepath.app.exceptions.queue import TooManyWaiting, TooManyWaitingOfClient
from joulepath.app.exceptions.stored import TooManyFigures, TooManyLogs, TooManyRobots
from joulepath.app.store import answers, figures, jobs, logs, robots
from joulepath.app.store.database import create_database_engine, migrate
from joulepath.app.store.jobs import NewJob, NewRequest
from joulepath.app.store.shares import stored_key
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Answer, OwnRobot, StoredLog, Study, new_id, now
from tests.app.databases import on_both_databases
from tests.app.store.test_store import A_DAY, insert_rows, migrate_to, put


async def queue(
    store: Store, count: int, owner: str | None, most: int = 100, key: str | None = None
) -> str:
    new = NewJob([NewRequest("optimize", b"{}", 10.0)] * count, f"{count}")
    create = partial(jobs.create, new=new, key=key, most_waiting=most, owner=owner)
    return (await store.write(create))[0]


async def test_no_client_takes_the_whole_queue(store: Store) -> None:
    await queue(store, 5, "press", most=10)
    with pytest.raises(TooManyWaitingOfClient):
        await queue(store, 1, "press", most=10)
    await queue(store, 3, "cell", most=10)
    with pytest.raises(TooManyWaitingOfClient):
        await queue(store, 1, "cell", most=10)
    await queue(store, 1, "dock", most=10)
    with pytest.raises(TooManyWaiting):
        await queue(store, 2, "dock", most=10)


async def test_without_keys_one_client_has_everything(store: Store) -> None:
    await queue(store, 10, None, most=10)
    with pytest.raises(TooManyWaiting):
        await queue(store, 1, None, most=10)


async def test_no_client_takes_all_robots_figures_or_logs(store: Store) -> None:
    def robot(session: Session, owner: str) -> None:
        row = OwnRobot(name=new_id(), created=now(), owner=owner, figures={}, warnings=[])
        robots.add(session, row, most=3)

    def figure(session: Session, owner: str) -> None:
        figures.put(session, figures.new_figures("ur5e", {"id": new_id()}, owner), most=3)

    def log(session: Session, owner: str) -> None:
        kind: dict[str, Any] = {"robot": "ur5e", "created": now(), "size": 1, "body": b"x"}
        row = StoredLog(id=new_id(), owner=owner, settings={}, report={}, **kind)
        logs.add(session, row, most=3)

    for add, error in (robot, TooManyRobots), (figure, TooManyFigures), (log, TooManyLogs):
        for _ in range(2):
            await store.write(partial(add, owner="press"))
        with pytest.raises(error):
            await store.write(partial(add, owner="press"))
        await store.write(partial(add, owner="cell"))


@on_both_databases
async def test_answers_of_a_client_with_few_outlive_a_flood(store: Store) -> None:
    kept = await store.write(partial(put, owner="cell"))
    flood = [await store.write(partial(put, owner="press")) for _ in range(5)]
    size = await store.read(lambda session: session.get_one(Answer, kept).size)
    await store.write(partial(answers.prune, max_bytes=3 * size, max_age=A_DAY))
    left = await store.read(lambda session: set(session.scalars(select(Answer.id))))
    assert left == {kept, *flood[-2:]}


async def test_a_client_with_an_equal_share_loses_no_answer(store: Store) -> None:
    """Whatever the sizes of its answers and of those of the others."""
    rng, owned = np.random.default_rng(0), dict[str, list[str]]()
    for owner, count, largest in ("cell", 3, 900), ("press", 30, 60), ("dock", 12, 300):
        bodies = [rng.bytes(int(size)) for size in rng.integers(1, largest, count)]
        owned[owner] = [await store.write(partial(put, body=b, owner=owner)) for b in bodies]
    of_owner = select(Answer.owner, func.sum(Answer.size)).group_by(Answer.owner)
    sizes: dict[str | None, int] = await store.read(
        lambda session: dict(session.execute(of_owner).all())
    )
    least = min(sizes, key=lambda owner: sizes[owner])
    most = len(sizes) * sizes[least]
    assert most < sum(sizes.values())
    await store.write(partial(answers.prune, max_bytes=most, max_age=A_DAY))
    left = await store.read(lambda session: set(session.scalars(select(Answer.id))))
    assert least is not None and set(owned[least]) <= left
    assert len(left) < sum(map(len, owned.values()))


def test_keys_of_an_earlier_version_become_those_of_their_clients(url: str) -> None:
    engine = create_database_engine(url)
    migrate_to(engine, "owners_of_requests")
    study = {"name": "n", "robot": "ur5e", "objective": "electrical", "threshold": 1.0}
    rows = [
        study | {"id": "a", "created": now(), "owner": "press", "idempotency_key": "night"},
        study | {"id": "b", "created": now(), "owner": None, "idempotency_key": "open"},
    ]
    insert_rows(engine, "studies", rows)
    migrate(engine)
    with engine.connect() as connection:
        found = connection.execute(select(Study.idempotency_key).order_by(Study.id)).scalars().all()
    assert found == [stored_key("night", "press"), stored_key("open", None)]
    engine.dispose()
