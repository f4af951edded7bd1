"""Databases of the tests: SQLite in a file, and a PostgreSQL server of their own if installed."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from joulepath.app.store.store import Store
from tests.app.live import free_port

START = 30.0
"""Until a new PostgreSQL server takes connections, at most [s]."""


@asynccontextmanager
async def opened(url: str) -> AsyncIterator[Store]:
    """The store of a database."""
    store = Store(url)
    try:
        yield store
    finally:
        await store.close()


def _binary(name: str) -> Path | None:
    # Debian keeps the servers of each version apart and off the path.
    found = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"))
    on_path = shutil.which(name)
    return found[-1] if found else Path(on_path) if on_path else None


def why_no_postgres() -> str | None:
    """Why no PostgreSQL server can be started here; None if one can."""
    if _binary("initdb") is None or _binary("postgres") is None:
        return "PostgreSQL's server is not installed (no initdb or postgres)"
    if os.geteuid() == 0 and "postgres" not in {user.pw_name for user in pwd.getpwall()}:
        return "PostgreSQL does not run as root, and there is no user postgres to run it as"
    return None


needs_postgres = pytest.mark.skipif(why_no_postgres() is not None, reason=str(why_no_postgres()))
on_both_databases = pytest.mark.parametrize(
    "url", ["sqlite", pytest.param("postgres", marks=needs_postgres)], indirect=True
)
"""For tests of what differs most: locks, tables and types. `make test-long` runs all on both."""


@dataclass
class Postgres:
    """A PostgreSQL server of the tests' own."""

    folder: Path
    port: int
    process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"postgresql://tester:secret-word@127.0.0.1:{self.port}/postgres"

    def start(self) -> None:
        command = [
            _binary("postgres"),
            "-D",
            self.folder / "data",
            "-p",
            self.port,
            "-k",
            self.folder,
        ]
        command += ["-c", "listen_addresses=127.0.0.1", "-c", "max_connections=30"]
        self.process = subprocess.Popen(
            [str(part) for part in command],
            user=_user(),
            stderr=(self.folder / "log").open("ab"),
            cwd=self.folder,
        )
        end = time.monotonic() + START
        while b"ready to accept" not in (self.folder / "log").read_bytes():
            assert self.process.poll() is None, (self.folder / "log").read_text()
            assert time.monotonic() < end, "PostgreSQL does not start"
            time.sleep(0.05)

    def stop(self) -> None:
        """Ends the server like a crash; the next start must find all acknowledged data."""
        if self.process is not None:
            self.process.send_signal(3)  # SIGQUIT, PostgreSQL's immediate shutdown
            self.process.wait(START)
            (self.folder / "log").unlink()
            self.process = None


def _user() -> str | None:
    return "postgres" if os.geteuid() == 0 else None


@contextmanager
def postgres() -> Iterator[Postgres]:
    """A new PostgreSQL server with an empty database."""
    folder = Path(tempfile.mkdtemp(prefix="joulepath-postgres-"))
    if _user():
        shutil.chown(folder, _user())
    try:
        words = folder / "password"
        words.write_text("secret-word")
        words.chmod(0o644)
        command = [
            _binary("initdb"),
            "-D",
            folder / "data",
            "-U",
            "tester",
            "--pwfile",
            words,
            "-A",
            "scram-sha-256",
        ]
        command += ["-E", "UTF8", "--locale=C"]
        subprocess.run(
            [str(part) for part in command],
            check=True,
            user=_user(),
            stdout=subprocess.DEVNULL,
            cwd=folder,
        )
        port = free_port()
        server = Postgres(folder, port)
        server.start()
        try:
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
