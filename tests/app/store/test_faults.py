"""Databases full, read-only, locked, deleted or replaced under a service: detected and reported."""

from __future__ import annotations

import os
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from joulepath.app.access.client import OPERATOR
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import StoreFault, StoreUnavailable
from joulepath.app.store import answers, studies
from joulepath.app.store.database import create_database_engine
from joulepath.app.store.store import Store
from joulepath.app.store.tables import new_id
from tests.app.databases import needs_postgres, opened, postgres
from tests.app.live import serving
from tests.app.requests import move
from tests.app.store.test_iterations import step
from tests.app.store.test_store import put, until_refused

NEARLY_FULL = 24 << 20


@pytest.fixture
def database(tmp_path: Path) -> Path:
    return tmp_path / "joulepath.db"


@pytest.fixture
def url(database: Path) -> str:
    return f"sqlite:///{database}"


async def refused(store: Store, work: Any = put, writes: bool = True) -> StoreFault:
    with pytest.raises(StoreUnavailable) as caught:
        await (store.write(work) if writes else store.read(work))
    return caught.value.cause


@pytest.mark.parametrize("lost", ["joulepath.db", "joulepath.db-wal"])
@pytest.mark.parametrize("how", ["deleted", "replaced"])
async def test_nothing_is_acknowledged_in_a_file_that_is_gone(
    database: Path, lost: str, how: str, store: Store
) -> None:
    await store.write(put)
    if how == "deleted":
        (database.parent / lost).unlink()
    else:
        (database.parent / "other").write_bytes((database.parent / lost).read_bytes())
        (database.parent / "other").rename(database.parent / lost)
    assert await refused(store) == "deleted"
    assert store.fault == "deleted"


async def test_a_file_that_goes_during_the_work_is_seen_at_its_end(
    database: Path, store: Store
) -> None:
    await store.write(put)

    def work(session: Any) -> None:
        put(session)
        database.unlink()

    assert await refused(store, work) == "deleted"


async def test_a_missing_database_is_not_replaced_by_an_empty_one(
    database: Path, store: Store
) -> None:
    kept = await store.write(put)
    await store.write(lambda session: session.connection().exec_driver_sql("SELECT 1"))
    aside = database.with_name("aside")
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("VACUUM INTO ?", (str(aside),))
    database.unlink()
    for _ in range(2):
        assert await refused(store) == "deleted"
        await store.check()
        assert store.fault == "deleted"
    assert not database.exists()
    # The file is put back and used again, without a restart.
    for path in database.parent.glob("joulepath.db-*"):
        path.unlink()
    aside.rename(database)
    await store.check()
    assert store.fault is None
    assert (await store.read(partial(answers.get, answer_id=kept)))[1] == b"{}"


async def test_a_read_only_database_is_read(database: Path) -> None:
    async with opened(f"sqlite:///{database}") as store:
        kept = await store.write(put)
    async with opened(f"sqlite:///file:{database}?mode=ro&uri=true") as store:
        assert (await store.read(partial(answers.get, answer_id=kept)))[1] == b"{}"
        assert await refused(store) == "read-only"
        await store.check()
        assert store.fault == "read-only"


async def test_a_lock_of_another_process_is_waited_for_once(database: Path, store: Store) -> None:
    now = 0.0
    kept = await store.write(put)
    # The clock replaces the wait.
    began = iter((0.0, 0.0, 100.0, 100.0))
    with closing(sqlite3.connect(database, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        store._clock = lambda: next(began)
        assert await refused(store) == "locked"
        assert store.fault == "locked"
        now = 100.5
        store._clock = lambda: now
        tried = 0

        def work(session: Any) -> None:
            nonlocal tried
            tried += 1

        assert await refused(store, work) == "locked" and tried == 0, "the next one does not wait"
        assert (await store.read(partial(answers.get, answer_id=kept)))[1] == b"{}", (
            "reading goes on"
        )
        other.execute("ROLLBACK")
    now = 102.0
    await store.check()
    assert store.fault is None
    await store.write(put)


async def test_too_little_room_is_told_by_its_code(store: Store) -> None:
    await store.write(put)

    def work(session: Any) -> None:
        session.connection().exec_driver_sql("PRAGMA max_page_count = 1")
        put(session, os.urandom(1 << 20))

    assert await refused(store, work) == "full"


@needs_postgres
async def test_faults_of_postgresql_are_told_by_their_codes() -> None:
    with postgres() as server:
        other = create_database_engine(server.url)
        async with opened(server.url) as store:
            kept = await store.write(put)
            with other.connect() as connection:
                connection.execute(text("LOCK TABLE answers IN SHARE MODE"))
                assert await refused(store) == "locked"
                assert (await store.read(partial(answers.get, answer_id=kept)))[1] == b"{}", (
                    "reading goes on"
                )
            with other.begin() as connection:
                connection.execute(text("ALTER ROLE tester SET default_transaction_read_only = on"))

        async with opened(server.url) as store:
            assert await refused(store) == "read-only"
            await store.check()
            assert store.fault == "read-only"

        other.dispose()


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own, of 24 MiB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={NEARLY_FULL}", "tmpfs", disk], capture_output=True
    )
    if made.returncode:
        pytest.skip("this test mounts a file system, which is not allowed here")
    try:
        yield disk
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


async def test_a_full_disk_is_freed_by_deleting(small_disk: Path) -> None:
    causes: list[StoreFault] = []

    async def fill(store: Store, study_id: str) -> int:
        """Adds iterations until the disk is full and returns the number of acknowledged ones."""
        count = 0
        while count < 10_000:
            try:
                large = replace(step(50.0), answer=StoredAnswer(new_id(), os.urandom(200_000)))
                await store.write(
                    partial(studies.add, study_id=study_id, step=large, key=None, client=OPERATOR)
                )
            except StoreUnavailable as error:
                causes.append(error.cause)
                return count
            count += 1
        raise AssertionError("the disk is never full")

    async with opened(f"sqlite:///{small_disk}/joulepath.db") as store:
        await store.open()
        assert (small_disk / "joulepath.db.reserve").stat().st_size > 0
        for _ in range(3):
            study = studies.new_study("A study", "ur5e", "electrical", 80.0, None, None)
            await store.write(partial(studies.create, study=study))
            count = await fill(store, study.id)
            assert causes.pop() == "full"
            # other files take all the room left
            left = os.statvfs(small_disk)
            (small_disk / "other").write_bytes(b"x" * (left.f_bavail * left.f_frsize))
            await store.check()
            assert store.fault == "full"
            state = await store.read(partial(studies.state, study_id=study.id))
            assert state.last is not None and state.last.number == count > 0, (
                "all that was acknowledged is there"
            )
            await store.write(
                partial(studies.delete, study_id=study.id, client=OPERATOR), frees=True
            )
            await store.check()
            assert store.fault is None
            (small_disk / "other").unlink()
            # The last round starts without a reserve; the room of the log suffices.
            await store.check()
        kept = await store.write(put)
        assert (await store.read(partial(answers.get, answer_id=kept)))[1] == b"{}"


def test_over_http_the_fault_is_said_and_answers_go_on(tmp_path: Path) -> None:
    database = tmp_path / "joulepath.db"
    with serving(recorded=True, database_url=f"sqlite:///{database}") as server:
        study = server.post("/studies", {"name": "A study", "threshold": 50.0}).headers["location"]
        first = server.post("/optimize", move())
        assert server.get(first.json()["answer"]).json()["answer"] == first.json()
        for path in tmp_path.glob("joulepath.db*"):
            path.unlink()
        answer = server.post("/studies", {"name": "Another study", "threshold": 50.0})
        assert (answer.status_code, answer.json()["cause"]) == (503, "deleted")
        until_refused(server, "deleted")
        assert server.get(study).status_code == 503
        second = server.post("/optimize", move())
        assert second.status_code == 200
        assert second.json()["answer"] is None, "it says that it is not kept"
        assert second.json()["energy"] == first.json()["energy"]
        assert not database.exists()
