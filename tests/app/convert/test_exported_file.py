"""The export formats of the contract are the library's, with the same options and defaults."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from joulepath.app.convert.exported_file import to_options
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.schemas.export import FORMATS as DESCRIBED
from joulepath.app.schemas.export import OPTIONS_OF, ExportFormat, ExportRequest
from joulepath.optimizer.export.export import FORMATS
from joulepath.optimizer.export.krl import KrlOptions
from joulepath.optimizer.export.ros_messages import Ros2Options


def request(**given: Any) -> ExportRequest:
    return ExportRequest.model_validate({"answer": "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"} | given)


def test_the_formats_are_those_of_the_library() -> None:
    assert [str(each) for each in DESCRIBED] == [str(each) for each in ExportFormat]
    assert {str(each) for each in ExportFormat} == FORMATS.keys()
    assert {str(each) for each in OPTIONS_OF} == {name for name, kind in FORMATS.items() if kind.options is not None}


@pytest.mark.parametrize("format", OPTIONS_OF)
def test_options_have_the_defaults_of_the_library(format: ExportFormat) -> None:
    kind, own = FORMATS[format.value].options, OPTIONS_OF[format]
    assert kind is not None
    for asked in (request(), request(**{own: {}})):
        assert to_options(asked, format, "yaml") == kind()
    schema = type(getattr(request(**{own: {}}), own))
    assert set(schema.model_fields) == {each.name for each in fields(kind)}


def test_the_request_names_options_and_the_client_prefers_an_encoding() -> None:
    asked = request(krl={"tolerance": 0.002, "signs": [1, -1, 1, 1, 1, 1], "digital_output": 3})
    assert to_options(asked, ExportFormat.KRL, "yaml") == KrlOptions(0.002, (1, -1, 1, 1, 1, 1), None, 3)
    assert to_options(request(), ExportFormat.ROS2, "json") == Ros2Options(encoding="json")
    named = request(ros2={"encoding": "yaml"})
    assert to_options(named, ExportFormat.ROS2, "json") == Ros2Options(encoding="yaml")
    assert to_options(request(), ExportFormat.JSON, "yaml") is None


def test_options_of_another_format_are_refused() -> None:
    with pytest.raises(InvalidRequest):
        to_options(request(krl={}), ExportFormat.RAPID, "yaml")
