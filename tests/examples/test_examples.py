"""The examples are requests that the service takes, and the paper's are what their script makes."""

import json
import runpy
from pathlib import Path

import pytest

from app.schemas.request import OptimizeRequest

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.glob("*.json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_example_is_a_valid_request(file: Path) -> None:
    OptimizeRequest.model_validate_json(file.read_bytes())


def test_paper_requests_are_up_to_date() -> None:
    script = runpy.run_path(str(EXAMPLES / "make_paper_requests.py"))
    made = script["requests"]()
    assert len(made) == 15
    assert {name: json.loads((EXAMPLES / name).read_text()) for name in made} == made
