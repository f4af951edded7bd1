"""The options of export formats in a request are those of the library, with the same defaults."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from joulepath import InvalidRequest, KrlOptions, Ros2Options
from joulepath.app.api.export.request import ExportRequest, option_field, to_options
from joulepath.app.schemas.given_answer import AnswerRequest
from joulepath.optimizer.export.export import FORMATS
from joulepath.optimizer.export.formats import FORMAT_NAMES, FormatName


def request(**given: Any) -> ExportRequest:
    return ExportRequest.model_validate({"answer": "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"} | given)


def test_every_name_has_a_format() -> None:
    assert list(FORMATS) == list(FORMAT_NAMES)


@pytest.mark.parametrize("format", FORMAT_NAMES)
def test_options_have_the_fields_and_defaults_of_the_library(format: FormatName) -> None:
    kind, own = FORMATS[format].options, option_field(format)
    if kind is None or own is None:
        assert kind is own is None
        return
    for asked in (request(), request(**{own: {}})):
        assert to_options(asked, format, "yaml") == kind()
    schema = type(getattr(request(**{own: {}}), own))
    assert set(schema.model_fields) == {each.name for each in fields(kind)}


def test_every_field_of_options_belongs_to_a_format() -> None:
    beside = ExportRequest.model_fields.keys() - AnswerRequest.model_fields.keys() - {"speed_scale"}
    assert beside == {option_field(each) for each in FORMAT_NAMES} - {None}


def test_the_request_names_options_and_the_client_prefers_an_encoding() -> None:
    asked = request(krl={"tolerance": 0.002, "signs": [1, -1, 1, 1, 1, 1], "digital_output": 3})
    assert to_options(asked, "krl", "yaml") == KrlOptions(0.002, (1, -1, 1, 1, 1, 1), None, 3)
    assert to_options(request(), "ros2", "json") == Ros2Options(encoding="json")
    named = request(ros2={"encoding": "yaml"})
    assert to_options(named, "ros2", "json") == Ros2Options(encoding="yaml")
    assert to_options(request(), "json", "yaml") is None


def test_options_of_another_format_are_refused() -> None:
    with pytest.raises(InvalidRequest):
        to_options(request(krl={}), "rapid", "yaml")
