"""Every example is answered by the endpoint that its folder is named after; the paper's are what their script makes."""

import json
import runpy
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from tests.app.live import ROOT
from tests.app.requests import PATIENT

EXAMPLES = ROOT / "examples"
WITH_DEADLINE = ("optimize", "compare", "pareto", "whatif")
FILES = sorted(EXAMPLES.rglob("*.json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_example_is_answered(file: Path, client: TestClient) -> None:
    path, body = file.parent.relative_to(EXAMPLES).as_posix(), json.loads(file.read_text())
    answer = client.post(f"/{path}", json=PATIENT | body if path in WITH_DEADLINE else body)
    assert answer.is_success, answer.text


def test_paper_requests_are_up_to_date() -> None:
    script = runpy.run_path(str(EXAMPLES / "make_paper_requests.py"))
    made = script["requests"]()
    assert len(made) == 15 + 3
    assert {name: json.loads((EXAMPLES / "optimize" / name).read_text()) for name in made} == made
    motions = script["motions"]()
    assert len(motions) == 15
    assert {name: json.loads((EXAMPLES / "evaluate" / name).read_text()) for name in motions} == motions


def test_csv_example_is_answered(client: TestClient) -> None:
    settings = {"units": "deg", "interpolation": "linear", "time_per_segment": "1.5"}
    content = (EXAMPLES / "evaluate" / "paper_motion_1.csv").read_bytes()
    by_csv = client.post("/evaluate", content=content, headers={"Content-Type": "text/csv"}, params=settings)
    by_json = client.post("/evaluate", json=json.loads((EXAMPLES / "evaluate" / "paper_motion_1.json").read_text()))
    ours, theirs = (answer.json()["total"]["energy"]["electrical"]["total"] for answer in (by_csv, by_json))
    assert ours == pytest.approx(theirs, rel=1e-9)
