"""The store: migrations, several processes at once, answers and limits, a missing database."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import hashlib
import json
import os
import sqlite3
import threading
import time
from dataclasses import replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import httpx2
import pytest
import sqlalchemy
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import Engine, MetaData, func, insert, inspect, select, text, update
from sqlalchemy.exc import DBAPIError
from starlette.testclient import TestClient

from joulepath.app.access.client import Client
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import StoreUnavailable, UnknownAnswer
from joulepath.app.store import answers, database
from joulepath.app.store.database import create_database_engine, migrate, sqlite_file
from joulepath.app.store.faults import OtherTables, OtherVersion, fault_of
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Answer, JobRequest, Table, new_id, now
from tests.app.databases import Postgres, needs_postgres, on_both_databases, opened
from tests.app.forks import Fork
from tests.app.live import ROOT, WARM_UP, Server, serving
from tests.app.problems import checked
from tests.app.requests import move

A_DAY = timedelta(days=1)
MUCH = 1 << 30


def put(session: Any, body: bytes = b"{}", kind: str = "optimize", owner: str | None = None) -> str:
    """Stores an answer and returns its id."""
    answer = StoredAnswer(new_id(), body)
    answers.put(session, kind, answer, owner=owner)
    return answer.id


def until_refused(server: Server, cause: str | None) -> None:
    """Waits until `/readyz` names this cause, or is ready if the cause is None."""
    end = time.monotonic() + WARM_UP
    while True:
        assert time.monotonic() < end, f"/readyz never says {cause}"
        with contextlib.suppress(httpx2.TransportError):
            answer = server.get("/readyz")
            if answer.status_code == 200 and cause is None:
                return
            if answer.json()["type"] == "/problems/store-unavailable":
                checked(StoreUnavailable, answer.content)
                if answer.json()["cause"] == cause:
                    return
        time.sleep(0.05)


def tables(url: str) -> list[Any]:
    """The differences between the tables of the database and the models."""
    engine = create_database_engine(url)
    with engine.connect() as connection:
        differences = compare_metadata(MigrationContext.configure(connection), Table.metadata)
    engine.dispose()
    return list(differences)


@on_both_databases
def test_migrations_make_what_the_models_say(url: str) -> None:
    migrate(create_database_engine(url))
    assert tables(url) == []
    migrate(create_database_engine(url))
    assert tables(url) == []


def migrate_to(engine: Engine, revision: str) -> None:
    """Migrates the tables of an empty database to an earlier version."""
    file = sqlite_file(engine.url)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
    config = Config()
    config.set_main_option("script_location", str(Path(database.__file__).parent / "migrations"))
    with engine.execution_options(writes=True).begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, revision)


def insert_rows(engine: Engine, table: str, rows: list[dict[str, Any]]) -> None:
    """Inserts rows into a table of an earlier version, whose columns no class declares."""
    with engine.execution_options(writes=True).begin() as connection:
        found = sqlalchemy.Table(table, MetaData(), autoload_with=connection)
        connection.execute(insert(found), rows)


def test_requests_of_an_earlier_version_get_the_owner_of_their_job(url: str) -> None:
    engine = create_database_engine(url)
    migrate_to(engine, "initial")
    job = {"state": "waiting", "keep_going": False, "total": 1, "ended_before": 0, "events": 0}
    job |= {"id": "j", "owner": "cell 7", "created": now(), "fingerprint": "f"}
    request = {"job_id": "j", "number": 0, "kind": "optimize", "deadline": 10.0, "body": b"{}"}
    request |= {"state": "waiting", "attempt": 0, "deaths": 0, "preempted": 0}
    insert_rows(engine, "jobs", [job])
    insert_rows(engine, "job_requests", [request])
    migrate(engine)
    assert tables(url) == []
    with engine.connect() as connection:
        assert connection.execute(select(JobRequest.owner)).scalar_one() == "cell 7"
    engine.dispose()


def test_an_early_first_migration_made_the_owners_itself(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/joulepath.db"
    engine = create_database_engine(url)
    migrate(engine)
    with engine.execution_options(writes=True).begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = 'initial'"))
    migrate(engine)
    assert tables(url) == []


def test_migrations_that_databases_have_seen_stay_as_they_are(tmp_path: Path) -> None:
    """A database keeps the number of its last migration: a change of the tables needs a new one."""
    engine = create_database_engine(f"sqlite:///{tmp_path}/joulepath.db")
    migrate_to(engine, "initial")
    found = inspect(engine)
    columns = [
        f"{table} {each['name']} {each['type']} {each['nullable']}"
        for table in sorted(found.get_table_names())
        for each in found.get_columns(table)
    ]
    digest = hashlib.sha256("\n".join(columns).encode()).hexdigest()
    assert digest[:16] == "863d42923786df84"


def test_a_database_of_another_version_is_refused_with_what_to_do(url: str) -> None:
    engine = create_database_engine(url)
    migrate(engine)
    with engine.execution_options(writes=True).begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = 'v0013'"))
    with pytest.raises(OtherVersion, match=r"v0013.*move the database away") as caught:
        migrate(engine)
    assert "secret" not in str(caught.value)
    assert fault_of(caught.value, None) == "other-version"
    engine.dispose()


@pytest.mark.parametrize(
    "change", ["ALTER TABLE studies DROP COLUMN threshold", "DROP TABLE alembic_version"]
)
def test_tables_of_other_makers_are_told_as_damage(url: str, change: str) -> None:
    engine = create_database_engine(url)
    migrate(engine)
    with engine.execution_options(writes=True).begin() as connection:
        connection.execute(text(change))
    named = r"lack studies\.threshold: restore" if "studies" in change else "figures"
    with pytest.raises((OtherTables, DBAPIError), match=named) as caught:
        migrate(engine)
    assert fault_of(caught.value, None) == "damaged"
    engine.dispose()


def test_a_file_that_is_no_database_is_told_as_damage(tmp_path: Path) -> None:
    (tmp_path / "joulepath.db").write_bytes(b"something else" * 100)
    with pytest.raises(DBAPIError) as caught:
        migrate(create_database_engine(f"sqlite:///{tmp_path}/joulepath.db"))
    assert fault_of(caught.value, None) == "damaged"


@pytest.mark.parametrize(("number", "told"), [(errno.ENOSPC, "full"), (errno.EROFS, "read-only")])
def test_a_folder_that_cannot_be_made_has_a_cause(number: int, told: str) -> None:
    assert fault_of(OSError(number, "of the folder"), None) == told


@on_both_databases
def test_several_processes_may_migrate_at_once(url: str) -> None:
    code = (
        "import os, sys; from joulepath.app.store.database import *; "
        "migrate(create_database_engine(sys.argv[1])); os._exit(0)"
    )
    processes = [Fork(("-c", code, url), os.environ, (0, 1, 2)) for _ in range(2)]
    assert [process.wait(60) for process in processes] == [0] * 2
    assert tables(url) == []


def test_a_new_file_that_another_process_makes_is_waited_for(tmp_path: Path) -> None:
    """SQLite itself does not wait while another process gives a new file its log."""
    file = tmp_path / "joulepath.db"
    other = sqlite3.connect(file, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    timer = threading.Timer(0.3, other.execute, ["COMMIT"])
    timer.start()
    engine = create_database_engine(f"sqlite:///{file}")
    with engine.connect() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar_one() == "wal"
    timer.join()
    other.close()


@needs_postgres
async def test_a_service_waits_while_another_one_migrates(
    server: Postgres, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first request waits even longer than PostgreSQL may take for an ordinary answer."""
    monkeypatch.setattr(database, "DATABASE", replace(database.DATABASE, server_timeout=0.5))
    with create_database_engine(server.url).begin() as connection:
        connection.execute(text("DROP SCHEMA public CASCADE"))
        connection.execute(text("CREATE SCHEMA public"))
    locked = threading.Event()

    def migrate_slowly() -> None:
        with create_database_engine(server.url).begin() as connection:
            connection.execute(
                text("SELECT pg_advisory_xact_lock(:key)"), {"key": database._MIGRATION_LOCK}
            )
            locked.set()
            time.sleep(3 * database.DATABASE.server_timeout)

    other = threading.Thread(target=migrate_slowly)
    other.start()
    assert locked.wait(30)
    async with opened(server.url) as store:
        await store.open()
        assert store.fault is None
        assert (
            await store.read(
                lambda session: session.scalar(select(func.count()).select_from(Answer))
            )
            == 0
        )
    other.join()


@on_both_databases
async def test_answers_are_kept_whole(store: Store) -> None:
    body = json.dumps({"energy": [1.5] * 1000, "name": "größte"}).encode()
    before = now()
    answer_id = await store.write(partial(put, body=body))
    answer, kept = await store.read(partial(answers.get, answer_id=answer_id))
    assert (answer.kind, kept) == ("optimize", body)
    assert before <= answer.created <= now()
    assert answer.size < len(body)
    with pytest.raises(UnknownAnswer):
        await store.read(partial(answers.get, answer_id="no\0such"))


async def test_typed_texts_take_room(store: Store) -> None:
    """The size of an answer counts only its last typed texts."""
    kept = await store.write(put)
    before = await store.read(lambda session: session.get_one(Answer, kept).size)
    client = Client("127.0.0.1")
    for typed in ({"/deadline": "9" * 60}, {"/deadline": "9,0"}, None):
        tell = partial(answers.rename, answer_id=kept, name=None, typed=typed, client=client)
        await store.write(tell)
    size = await store.read(lambda session: session.get_one(Answer, kept).size)
    assert size == before + len('{"/deadline":"9,0"}') - len("{}")


async def test_the_oldest_answers_make_room(store: Store) -> None:
    async def left() -> set[str]:
        return set(await store.read(lambda session: session.scalars(select(Answer.id)).all()))

    ids = [await store.write(put) for _ in range(5)]
    size = await store.read(lambda session: session.get_one(Answer, ids[0]).size)
    await store.write(partial(answers.prune, max_bytes=3 * size, max_age=A_DAY))
    assert await left() == set(ids[2:])
    await store.write(
        lambda session: session.execute(
            update(Answer).where(Answer.id.in_([ids[2], ids[4]])).values(created=now() - 2 * A_DAY)
        )
    )
    await store.write(partial(answers.prune, max_bytes=MUCH, max_age=A_DAY))
    assert await left() == {ids[3]}


async def test_work_that_fails_changes_nothing(store: Store) -> None:
    def fail(session: Any) -> None:
        put(session)
        session.flush()
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        await store.write(fail)
    assert await store.read(lambda session: session.scalar(select(func.count(Answer.id)))) == 0


async def test_writers_wait_for_each_other(store: Store) -> None:
    assert len(set(await asyncio.gather(*(store.write(put) for _ in range(50))))) == 50


@pytest.mark.parametrize(
    "id", ["none", "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11", "x" * 5000, "%00", "%ff", "ü"]
)
def test_unknown_answer(client: TestClient, id: str) -> None:
    answer = client.get(f"/answers/{id}")
    assert answer.status_code == 404
    checked(UnknownAnswer, answer.content)


@pytest.mark.parametrize(
    ("url", "cause"),
    [
        ("postgresql://tester:secret-word@127.0.0.1:1/postgres", "unreachable"),
        pytest.param("sqlite:////proc/joulepath.db", "unreachable", marks=pytest.mark.long),
        pytest.param(f"sqlite:///{ROOT}/README.md", "damaged", marks=pytest.mark.long),
    ],
)
def test_without_its_database_the_service_goes_on(url: str, cause: str) -> None:
    with serving(warm=False, recorded=True, database_url=url) as server:
        until_refused(server, cause)
        assert server.get("/healthz").status_code == 200
        assert server.post("/optimize", move()).status_code == 200
        answer = server.get("/answers/none")
        assert answer.status_code == 503
        checked(StoreUnavailable, answer.content)
        assert int(answer.headers["retry-after"]) > 0
        assert server.terminate() == 0
        errors = [entry for entry in server.logged() if entry["level"] == "error"]
        said = [entry for entry in errors if "the database cannot be used" in entry["message"]]
        assert len(said) == 1, "said once, not with every check"
        assert all(
            entry["reason"] for entry in errors if entry["message"] == "database unavailable"
        )
        assert "secret-word" not in str(server.logged())


@needs_postgres
async def test_a_database_that_comes_back_is_used_again(server: Postgres) -> None:
    async with opened(server.url) as store:
        answer_id = await store.write(put)
        server.stop()
        with pytest.raises(StoreUnavailable):
            await store.read(partial(answers.get, answer_id=answer_id))
        server.start()
        assert (await store.read(partial(answers.get, answer_id=answer_id)))[1] == b"{}"
