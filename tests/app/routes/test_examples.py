"""The files in `examples` are answered by the endpoints that name their folders."""

from __future__ import annotations

import json
import runpy

import pytest
from fastapi.testclient import TestClient

from joulepath.app.schemas.examples.bodies import BODY_EXAMPLES, JSON
from tests.app.job_clients import ended, sent
from tests.app.live import ROOT
from tests.app.requests import PATIENT
from tests.selection import long_but

EXAMPLES = ROOT / "examples"
WITH_DEADLINE = ("optimize", "compare", "pareto", "cycle", "whatif", "replay")
FILES = {
    file.relative_to(EXAMPLES).with_suffix("").as_posix(): file
    for file in sorted(EXAMPLES.rglob("*.json"))
}
FILES = {name: file for name, file in FILES.items() if not name.startswith("openapi/")}
IN_THE_DOCUMENT = {
    f"{path[1:]}/{name}": example["value"]
    for path, by_media_type in BODY_EXAMPLES.items()
    for name, example in by_media_type.get(JSON, {}).items()
}

# the test of the OpenAPI document sends these examples
SENT = FILES.keys() - IN_THE_DOCUMENT.keys()
# answered in seconds, each with a deadline of its own
SLOW = {
    "cycle/round_parts",
    "cycle/seam_any_turn",
    "optimize/seam_any_turn",
    "optimize/polynomial_ga",
    "placement/conveyor",
    "placement/two_tables",
    "replay/lift_with_payload",
}
# the first of the paper's moves and motions stands for all; others are much like what tests send
FURTHER = {name for name in SENT if "/paper_" in name and not name.endswith("_1")}
FURTHER |= {"optimize/bin_to_shelf", "optimize/free_orientation", "optimize/suction_cup_any_turn"}


def test_a_file_holds_the_documents_example_of_its_name() -> None:
    shared = FILES.keys() & IN_THE_DOCUMENT.keys()
    assert len(shared) >= 15, "the names no longer match"
    assert {name: json.loads(FILES[name].read_text()) for name in shared} == {
        name: IN_THE_DOCUMENT[name] for name in shared
    }


@pytest.mark.parametrize("name", long_but(SENT - SLOW - FURTHER, sorted(SENT)))
def test_file_is_answered(name: str, client: TestClient) -> None:
    path, body = name.rpartition("/")[0], json.loads(FILES[name].read_text())
    answer = client.post(f"/{path}", json=PATIENT | body if path in WITH_DEADLINE else body)
    assert answer.is_success, answer.text


def test_a_slow_example_names_its_own_deadline() -> None:
    """An example is answered within the default deadline, or brings a longer deadline."""
    assert all("deadline" in json.loads(FILES[name].read_text()) for name in SLOW)


def test_the_job_example_runs_to_its_end(client: TestClient) -> None:
    """One of the requests of the job shows the problem of a motion with too short a duration."""
    asked = json.loads(FILES["jobs/moves"].read_text())
    job = ended(client, sent(client, asked.pop("requests"), **asked))
    assert job["state"] == "done"
    problems = [(each["problem"] or {}).get("type") for each in job["requests"]]
    assert problems == [None, None, "/problems/duration-too-short", None]


def test_paper_requests_are_up_to_date() -> None:
    script = runpy.run_path(str(EXAMPLES / "make_paper_requests.py"))
    made = script["requests"]()
    assert len(made) == 15 + 3
    assert {name: json.loads((EXAMPLES / "optimize" / name).read_text()) for name in made} == made
    motions = script["motions"]()
    assert len(motions) == 15
    assert {
        name: json.loads((EXAMPLES / "evaluate" / name).read_text()) for name in motions
    } == motions


def test_csv_example_is_answered(client: TestClient) -> None:
    settings = {"units": "deg", "interpolation": "linear", "time_per_segment": "1.5"}
    content = (EXAMPLES / "evaluate" / "paper_motion_1.csv").read_bytes()
    by_csv = client.post(
        "/evaluate", content=content, headers={"Content-Type": "text/csv"}, params=settings
    )
    by_json = client.post(
        "/evaluate", json=json.loads((EXAMPLES / "evaluate" / "paper_motion_1.json").read_text())
    )
    ours, theirs = (
        answer.json()["total"]["energy"]["electrical"]["total"] for answer in (by_csv, by_json)
    )
    assert ours == pytest.approx(theirs, rel=1e-9)
