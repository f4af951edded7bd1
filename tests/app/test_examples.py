"""Every example is answered by the endpoint that its folder is named after; the paper's are what their script makes."""

import json
import runpy
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.glob("*/*.json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_example_is_answered(file: Path, client: TestClient) -> None:
    headers = {"Content-Type": "application/json"}
    answer = client.post(f"/{file.parent.name}", content=file.read_bytes(), headers=headers)
    assert answer.is_success, answer.text


def test_paper_requests_are_up_to_date() -> None:
    script = runpy.run_path(str(EXAMPLES / "make_paper_requests.py"))
    made = script["requests"]()
    assert len(made) == 15 + 3
    assert {name: json.loads((EXAMPLES / "optimize" / name).read_text()) for name in made} == made
