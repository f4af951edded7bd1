"""JSON of answers and its schema, both from declarations of classes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple, NotRequired, TypedDict

import numpy as np
import orjson
import pytest
from pydantic import ValidationError

from joulepath import Baseline, Certificate, Clearance
from joulepath.app.answers.declared import as_json, model_of, texts_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.engine.result import json_document
from joulepath.optimizer.collision.close_pass import CLOSE_PASS
from joulepath.optimizer.declared import (
    Axes,
    Internal,
    Joules,
    Keys,
    NotEmpty,
    NullIfNotFinite,
    PerJoint,
    Unit,
)
from joulepath.optimizer.presentation.declared_fields import shown_fields
from tests.app.live import ROOT


class Place(NamedTuple):
    """A place."""

    x: Annotated[float, Unit("m")]
    """Distance; from the base."""
    secret: Annotated[int, Internal] = 3


class Parts(TypedDict):
    """Energies by their names."""

    total: Joules
    """All of it."""
    lost: NotRequired[Joules]
    """What is lost."""


@dataclass(frozen=True, kw_only=True)
class First:
    """The common fields."""

    name: Literal["a", "b"]
    """Name."""
    bound: Annotated[Joules, NullIfNotFinite] = math.inf
    """Bound."""


@dataclass(frozen=True, kw_only=True)
class Whole(First):
    """A class with all kinds of fields."""

    q: Annotated[PerJoint, Unit("rad")] | None
    """Joint positions."""
    rows: Annotated[PerJoint, Axes(("row",)), NullIfNotFinite]
    """Rows."""
    places: Annotated[list[Place], NotEmpty]
    """Places."""
    parts: Annotated[dict[str, float], Keys(Parts)]
    """Parts."""
    pair: tuple[str, str]
    """Names."""
    is_far: bool = field(init=False)
    """Whether it is far."""
    hidden: Annotated[object, Internal] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_far", True)


WHOLE = Whole(
    name="a",
    q=np.array([[1.0, 2.0], [3.0, 4.0]])[:, 1],
    rows=np.array([[1.0, math.inf]]),
    places=[Place(1.5)],
    parts={"total": 2.0},
    pair=("arm", "table"),
    hidden=object(),
)


def test_json_has_the_shown_fields_in_their_order() -> None:
    assert json_document(WHOLE) == (
        b'{"name":"a","bound":null,"q":[2.0,4.0],"rows":[[1.0,null]],"places":[{"x":1.5}],'
        b'"parts":{"total":2.0},'
        b'"pair":["arm","table"],"is_far":true}'
    )
    assert shown_fields(Place) == ("x",) and as_json(Place(2.0)) == {"x": 2.0}


def test_the_model_takes_the_json_and_nothing_else() -> None:
    model, content = model_of(Whole), orjson.loads(json_document(WHOLE))
    model.model_validate_json(json_document(WHOLE))
    model.model_validate_json(orjson.dumps(content | {"parts": {"total": 1.0, "lost": 0.5}}))
    for wrong in (
        {"more": 1},
        {"places": []},
        {"name": "c"},
        {"bound": "1"},
        {"parts": {}},
        {"parts": {"total": 1.0, "lost": None}},
        {"q": [[1.0]]},
        {"is_far": None},
    ):
        with pytest.raises(ValidationError):
            model.model_validate_json(orjson.dumps(content | wrong))
    for name in content:
        with pytest.raises(ValidationError):
            model.model_validate_json(
                orjson.dumps({key: content[key] for key in content if key != name})
            )


def test_the_schema_has_meanings_and_units() -> None:
    schema = model_of(Whole).model_json_schema()
    place, own = schema["$defs"]["Place"], schema["properties"]
    assert schema["description"] == "A class with all kinds of fields."
    assert place["description"] == "A place."
    assert place["properties"]["x"] == {
        "title": "X",
        "type": "number",
        "description": "Distance [m]; from the base.",
        "x-unit": "m",
    }
    assert {name: own[name].get("x-unit") for name in ("name", "bound", "q")} == {
        "name": None,
        "bound": "J",
        "q": "rad",
    }
    assert own["places"]["minItems"] == 1
    assert schema["$defs"]["Parts"]["required"] == ["total"]
    assert "default" not in str(schema)


def test_a_field_without_a_text_is_refused() -> None:
    @dataclass
    class Silent:
        x: float

    with pytest.raises(TypeError, match=r"Silent\.x has no text below it"):
        model_of(Silent)
    with pytest.raises(TypeError, match="int declares no fields"):
        as_json(3)


def test_what_the_library_keeps_to_itself() -> None:
    """The internal fields are listed here, so a new field of the library is public by default."""
    kept: dict[type[Any], set[str]] = {
        Certificate: {"rest_error", "pass_error", "close_pass"},
        Baseline: {"sensitivity", "at_goal"},
        Clearance: set(),
    }
    for kind, internal in kept.items():
        assert set(kind.__dataclass_fields__) - set(shown_fields(kind)) == internal


def test_the_text_of_warnings_names_the_distance() -> None:
    assert f"closer than {CLOSE_PASS.distance * 1e3:g} mm" in texts_of(OptimizeAnswer)["warnings"]


def test_only_one_module_reads_the_markers() -> None:
    """Other modules only write the markers into types."""
    readers = {
        path.relative_to(ROOT).as_posix()
        for package in ("app", "optimizer")
        for path in (ROOT / package).rglob("*.py")
        if "include_extras=True" in path.read_text("utf-8")
    }
    assert readers == {"optimizer/presentation/declared_fields.py"}
