"""`deploy/backup.sh`: a backup under load has all acknowledged data, and a service runs on it."""

from __future__ import annotations

import asyncio
import os
import shutil
import sqlite3
import subprocess
import threading
from functools import partial
from pathlib import Path

import pytest

from joulepath.app.store import studies
from tests.app.databases import opened, postgres, why_no_postgres
from tests.app.live import ROOT, Server, serving

SCRIPT = ROOT / "deploy" / "backup.sh"
BEFORE = 30
MEANWHILE = 30
MISSING = (
    why_no_postgres() or (shutil.which("pg_dump") is None and "pg_dump is not installed") or None
)


def begin(server: Server, name: str) -> str:
    answer = server.post("/studies", {"name": name, "threshold": 1.0})
    assert answer.status_code == 201
    return str(answer.json()["id"])


def back_up_under_load(server: Server, url: str, file: Path) -> list[str]:
    """The ids acknowledged before the start of the backup; writing goes on during its run."""
    before = [begin(server, f"before {k}") for k in range(BEFORE)]
    enough, stop = threading.Event(), threading.Event()
    written = 0

    def write() -> None:
        nonlocal written
        while not stop.is_set():
            begin(server, f"meanwhile {written}")
            written += 1
            if written >= MEANWHILE:
                enough.set()

    writer = threading.Thread(target=write)
    writer.start()
    try:
        subprocess.run([SCRIPT, url, file], check=True, env=os.environ)
        assert enough.wait(60), "the load goes on"
        subprocess.run([SCRIPT, url, file], check=True, env=os.environ)
    finally:
        stop.set()
        writer.join()
    assert sorted(path.name for path in file.parent.iterdir()) == [file.name], (
        "nothing else is left"
    )
    return before


async def assert_all_there(url: str, ids: list[str]) -> None:
    """The service reads all ids from the database, after a migration if necessary."""
    async with opened(url) as store:
        for id in ids:
            await store.read(partial(studies.history, study_id=id))


@pytest.mark.long
def test_sqlite_under_load(tmp_path: Path) -> None:
    (tmp_path / "backup").mkdir()
    file = tmp_path / "backup" / "joulepath.db"
    url = f"sqlite:///{tmp_path}/joulepath.db"
    with serving(recorded=True, database_url=url) as server:
        ids = back_up_under_load(server, url, file)
        server.process.kill()
    with sqlite3.connect(file) as copy:
        assert copy.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert copy.execute("SELECT count(*) FROM studies").fetchone()[0] >= BEFORE + MEANWHILE
    asyncio.run(assert_all_there(f"sqlite:///{file}", ids))


def test_a_backup_that_fails_leaves_the_last_one(tmp_path: Path) -> None:
    file = tmp_path / "joulepath.db"
    file.write_text("the last one")
    for url in (f"sqlite:///{tmp_path}/none.db", f"sqlite:///{file}", "mysql://host/name"):
        assert subprocess.run([SCRIPT, url, file], capture_output=True).returncode != 0
        assert file.read_text() == "the last one"
        assert not (tmp_path / "none.db").exists(), "no empty database is made and copied"


@pytest.mark.long
@pytest.mark.skipif(MISSING is not None, reason=str(MISSING))
def test_postgresql_under_load(tmp_path: Path) -> None:
    (tmp_path / "backup").mkdir()
    file = tmp_path / "backup" / "joulepath.dump"
    with postgres() as database:
        with serving(recorded=True, database_url=database.url) as server:
            ids = back_up_under_load(server, database.url, file)
        empty = database.url.rpartition("/")[0] + "/restored"
        subprocess.run(
            ["psql", database.url, "--quiet", "--command", "CREATE DATABASE restored"], check=True
        )
        subprocess.run(["pg_restore", "--dbname", empty, "--no-owner", file], check=True)
        asyncio.run(assert_all_there(empty, ids))
