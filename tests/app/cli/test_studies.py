"""`joulepath studies`, by a service in this process."""

from __future__ import annotations

import csv
import io
import json

import pytest

from tests.app.cli.console import Here
from tests.app.requests import move

UNKNOWN = "9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"
pytestmark = pytest.mark.usefixtures("service")


def begun(here: Here) -> str:
    """The id of a new study."""
    code, out, _ = here.run("studies", "begin", "--name", "Lift", "--threshold", "500")
    assert code == 0
    return out.decode().strip()


def test_a_study_from_begin_to_end(here: Here) -> None:
    study = begun(here)
    first = json.loads(here.run("studies", "add", study, "-", stdin=json.dumps(move()))[1])
    step = json.dumps({"optimize": move(duration={"min": 3.0, "max": 3.0})})
    second = json.loads(here.run("studies", "add", study, "-", stdin=step)[1])
    assert (first["number"], second["number"]) == (1, 2)
    assert second["change_from_last"] == pytest.approx(second["energy"] - first["energy"])
    assert second["change_from_last"] > 0
    (row,) = (
        line for line in here.run("studies")[1].decode().splitlines() if line.startswith(study)
    )
    assert row.split()[1:] == [
        *("Lift", "ur5e", "2"),
        *(f"{each['energy']:.1f}" for each in (second, first)),
        *("500.0", "yes"),
    ]
    shown = json.loads(here.run("studies", "show", study)[1])
    assert [each["energy"] for each in shown["history"]] == [first["energy"], second["energy"]]
    table = here.run("studies", "show", study, "--format", "csv")[1].decode()
    assert [row["iteration"] for row in csv.DictReader(io.StringIO(table))] == ["1", "2"]
    found = json.loads(here.run("studies", "suggest", study)[1])
    assert found["study"] == study and found["base"]["number"] == 1
    assert here.run("studies", "delete", study) == (0, b"", b"")
    code, problem = here.problem("studies", "show", study)
    assert (code, problem["type"]) == (1, "/problems/unknown-study")


def test_what_is_refused(here: Here) -> None:
    code, problem = here.problem("studies", "add", begun(here), "-", stdin=json.dumps({"a": 1}))
    assert (code, problem["type"]) == (2, "/problems/invalid-request")
    code, problem = here.problem("studies", "suggest", UNKNOWN)
    assert (code, problem["type"]) == (1, "/problems/unknown-study")
    assert here.run("studies", "begin", "--name", "no threshold")[0] == 2
