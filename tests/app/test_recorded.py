"""The recordings of `tests.app.recorded` equal the answers of the service today."""

from __future__ import annotations

from typing import Any

import orjson
import pytest
from pydantic import BaseModel
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.compare.task import CompareAnswer
from joulepath.app.api.cycle.task import CycleAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.pareto.task import ParetoAnswer
from tests.app.recorded import FOLDER, TASKS, record

SCHEMAS: dict[str, type[BaseModel]] = {
    "optimize": model_of(OptimizeAnswer),
    "compare": model_of(CompareAnswer),
    "pareto": model_of(ParetoAnswer),
    "cycle": model_of(CycleAnswer),
}


def shape(value: Any) -> Any:
    """A document without its values: names of fields, and types; lists have the shapes of
    entries.
    """
    if isinstance(value, dict):
        return {name: shape(each) for name, each in value.items()}
    if isinstance(value, list):
        return [shape(each) for each in value[:1]]
    return (
        "number"
        if isinstance(value, int | float) and not isinstance(value, bool)
        else type(value).__name__
    )


@pytest.mark.parametrize("kind", TASKS)
def test_recordings_keep_to_the_schemas(kind: str) -> None:
    recording = orjson.loads((FOLDER / f"{kind}.json").read_bytes())
    SCHEMAS[kind].model_validate_json(orjson.dumps(recording["document"]))
    for each in recording["stored"]:
        model_of(OptimizeAnswer).model_validate_json(orjson.dumps(each))


@pytest.mark.long
@pytest.mark.parametrize("kind", TASKS)
def test_recordings_have_the_shape_of_new_ones(kind: str) -> None:
    """If they differ: `python -m tests.app.recorded record`."""
    assert shape(orjson.loads((FOLDER / f"{kind}.json").read_bytes())) == shape(record(kind))


def test_recorded_answers_differ_in_their_ids(recorded: TestClient) -> None:
    request = TASKS["pareto"].request  # type: ignore[attr-defined]
    body = request.model_dump(mode="json", exclude_unset=True)
    fronts = [recorded.post("/pareto", json=body).json() for _ in range(2)]
    paths = [point["answer"] for front in fronts for point in front["points"]]
    assert len(set(paths)) == len(paths) > 1
    assert [recorded.get(path).json()["answer"]["answer"] for path in paths] == paths
