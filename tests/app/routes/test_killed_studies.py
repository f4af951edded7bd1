"""Acknowledged parts of a study outlive a killed service."""

from __future__ import annotations

import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from tests.app.databases import postgres, why_no_postgres
from tests.app.live import Server, serving
from tests.app.routes.test_studies import LINE, added, begin, shown


def databases() -> list[Any]:
    missing = why_no_postgres()
    skipped = pytest.mark.skipif(missing is not None, reason=str(missing))
    return ["sqlite", pytest.param("postgres", marks=[skipped, pytest.mark.long])]


class Over:
    """A live server, called as a test client is."""

    def __init__(self, server: Server) -> None:
        self.get = server.get
        self._server = server

    def post(self, path: str, json: Any, **options: Any) -> Any:
        return self._server.post(path, json, **options)


@pytest.mark.long
@pytest.mark.parametrize("kind", databases())
def test_what_was_acknowledged_outlives_a_kill(kind: str, tmp_path: Path) -> None:
    if kind == "sqlite":
        check_kill(f"sqlite:///{tmp_path}/joulepath.db")
    else:
        with postgres() as database:
            check_kill(database.url)


def check_kill(url: str) -> None:
    """Kills one of two servers on one database right after its answers, and asks the
    other one and a restarted one.
    """
    with serving(workers=1, database_url=url) as other:
        with serving(workers=1, database_url=url) as killed:
            path = begin(Over(killed))
            step = added(Over(killed), path, LINE)
            killed.process.send_signal(signal.SIGKILL)
            killed.process.wait()
        with serving(workers=1, database_url=url) as restarted:
            for server in (other, restarted):
                assert [entry["answer"] for entry in shown(Over(server), path)["history"]] == [
                    step["answer"]
                ]
                kept = server.get(f"/answers/{step['answer']}").json()["answer"]
                assert kept["energy"]["electrical"]["total"] == step["energy"]
            # both servers, at once: numbers are counted without gaps and none is given twice
            with ThreadPoolExecutor(6) as pool:
                servers = [other, restarted] * 3
                numbers = list(
                    pool.map(lambda server: added(Over(server), path, LINE)["number"], servers)
                )
            assert sorted(numbers) == list(range(2, 8))
            for server in (other, restarted):
                assert [entry["number"] for entry in shown(Over(server), path)["history"]] == list(
                    range(1, 8)
                )
