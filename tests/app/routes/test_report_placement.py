"""POST /report on a placement: its map, its best place against the nominal one, and its check."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import attached_to, in_html
from joulepath.app.api.report.check import checked
from joulepath.app.api.report.map_drawing import columns_of, drawn_map
from joulepath.app.api.report.numbers import digits, percent, up
from tests.app.routes.test_placement import ASKED, CYCLE, placed
from tests.app.routes.test_report import reported

Json = dict[str, Any]
FAR = {"position": [3.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]}
TWO = ASKED | {"region": {"places": [*ASKED["region"]["places"], FAR]}}
"""A placement with a place that works and one that is out of reach."""


@pytest.fixture(scope="module")
def answer(client: TestClient) -> Json:
    return placed(client, TWO)


@pytest.fixture(scope="module")
def page(client: TestClient, answer: Json) -> bytes:
    costs = {"price": {"value": 0.2}, "shifts_per_year": {"value": 460}}
    return reported(client, placement=TWO, answer=answer["id"], costs=costs)


def test_the_page_says_what_the_answer_says(page: bytes, answer: Json) -> None:
    bundle, text = attached_to(page), page.decode()
    assert bundle.kind == "placement" and bundle.answer["id"] == answer["id"]
    assert [row["place"] for row in bundle.moves] == ["best", "nominal"]
    best, nominal = answer["best"]["energy"], answer["nominal"]["energy"]
    for words in (
        f"<b>{digits(best)}\u00a0J</b>",
        f"<b>{percent(answer['saving'])} less</b>",
        f"at most {percent(best / answer['lower_bound'] - 1, 'up')} above",
        f"<strong>{digits(nominal)}</strong> J",
        f"{up(bundle.moves[1]['answer']['energy']['electrical']['interval']['p95'])}",
        "out of reach",
        "x 3000, y 0, z 0 mm",
        "x −50, y 0, z 100 mm, yaw 17°",
    ):
        assert words in text, words
    assert "was not computed" in text
    assert text.count('class="claimed saves"') == 2


@pytest.mark.long
def test_it_agrees_with_itself_and_with_its_cycles_answered_anew(page: bytes) -> None:
    found = checked(page, again=True, request_id="test")
    assert found.agrees, found.lines
    assert [line.what for line in found.lines][-3:] == [
        "page",
        "cycle at the best place, answered again",
        "cycle at the nominal place, answered again",
    ]


def test_what_was_changed_is_found(page: bytes) -> None:
    bundle = attached_to(page)
    cheaper = bundle.answer["best"] | {"energy": 0.9 * bundle.answer["best"]["energy"]}
    changed = replace(bundle, answer=bundle.answer | {"best": cheaper})
    file = page.replace(in_html(bundle.packed()).encode(), in_html(changed.packed()).encode())
    assert [line.what for line in checked(file, False, "test").lines if not line.agrees] == [
        "sum of the cycles at the best place",
        "page",
    ]


def test_a_nominal_place_that_fails_and_a_tolerance_are_told(page: bytes) -> None:
    bundle = attached_to(page)
    tolerance = [
        {"body": 0, "coordinate": "x", "lower": -0.012, "upper": 0.03},
        {"body": 0, "coordinate": "yaw", "lower": 0.0, "upper": 0.1},
    ]
    answer = bundle.answer | {"nominal": None, "nominal_reason": "reach", "saving": None}
    rows = [row for row in bundle.moves if row["place"] == "best"]
    report = report_of(
        replace(bundle, answer=answer | {"tolerance": tolerance, "lower_bound": None}, moves=rows)
    )
    assert report.lead[0].endswith("The nominal place has no cycle: a stop is out of reach.")
    assert report.lead[1] == "No positive lower bound is known for this task."
    offset = "an offset of −12\u00a0mm to +30\u00a0mm in x, or +0° to +6° in yaw."
    assert offset in report.rivals_note
    assert [each.name for each in report.rivals] == ["Best place", "Worst place of the map"]


@pytest.mark.long
def test_several_cycles_count_by_their_weights(client: TestClient) -> None:
    cycles = [{"cycle": CYCLE, "weight": 3.0}, {"cycle": CYCLE | {"closed": False}}]
    asked = {**TWO, "cycle": None, "cycles": cycles, "region": ASKED["region"]}
    page = reported(client, placement=asked)
    bundle, text = attached_to(page), page.decode()
    weights = [row["weight"] for row in bundle.moves if row["place"] == "best"]
    assert weights == [3.0, 1.0]
    assert "2 cycles, multiplied by their weights, need" in text
    assert f"<strong>{digits(bundle.answer['best']['energy'])}</strong> J" in text
    assert checked(page, False, "test").agrees


@pytest.mark.long
def test_an_answer_of_something_else_is_refused(client: TestClient) -> None:
    cycle = client.post("/cycle", json=CYCLE).json()
    refused = client.post("/report", json={"placement": TWO, "answer": cycle["id"]})
    assert refused.status_code == 422 and "another request" in refused.json()["errors"][0]["msg"]
    both = client.post("/report", json={"placement": TWO, "cycle": CYCLE})
    assert both.status_code == 422 and "placement" in both.json()["errors"][0]["msg"]


def point(x: float, energy: float | None, reason: str | None = None, z: float = 0.0) -> Json:
    base = {"position": [x, 0.0, z], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    return {"base": base, "offsets": [], "energy": energy, "reason": reason}


def test_the_map_shows_the_best_of_each_column_and_marks_the_others() -> None:
    places = [
        point(0.0, 12.0),
        point(0.0, 10.0, z=0.1),
        point(0.1, 20.0),
        point(0.2, None, "reach"),
        point(0.2, None, z=0.1),
        point(0.3, None, "torque"),
    ]
    columns = columns_of(places)
    assert [each["energy"] for each in columns] == [10.0, 20.0, None, None]
    # One height was not computed, so the column may be feasible.
    assert [each["reason"] for each in columns] == [None, None, None, "torque"]
    drawing = drawn_map(places, places[1], None)
    assert drawing.count("<rect") == 2 + 7 and "not computed" in drawing
    assert "#00306f" in drawing and "#ffe945" in drawing
    assert "insufficient torque" in drawing and "out of reach" not in drawing
    assert "best place" in drawing and "nominal place" not in drawing


def test_a_map_without_any_energy_is_drawn() -> None:
    best = point(0.0, 10.0)
    drawing = drawn_map([point(0.0, None)], best, best)
    assert "<rect" not in drawing and drawing.startswith("<svg")
