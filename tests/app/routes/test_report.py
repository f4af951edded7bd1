"""POST /report: the text of the page, its attachments, and the findings of the check."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from starlette.testclient import TestClient

from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle, NoReport, attached_to, in_html
from joulepath.app.api.report.check import checked
from joulepath.app.api.report.motion_report import course_of
from joulepath.app.api.report.numbers import amount, counted, digits, down, percent, up
from joulepath.app.api.report.pdf import pdf
from joulepath.app.api.report.programs import program_of
from joulepath.app.api.report.rivals import their_energy
from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.optimizer.dynamics.losses import saving
from tests.app.live import ROOT
from tests.app.requests import HOME, NEAR, move

Json = dict[str, Any]
COSTS = {
    "cycles_per_shift": {"value": 2000, "source": "line plan"},
    "shifts_per_year": {"value": 200},
    "price": {"value": 0.25, "source": "contract"},
    "currency": "CHF",
    "carbon": {"value": 0.4},
}
CYCLE = {
    "start": {"q": HOME},
    "stops": [
        {"name": "pick", "target": {"q": NEAR}, "payload": {"mass": 1.0, "com": [0, 0, 0.1]}},
        {"name": "place", "target": {"q": [0.5, -1.3, 1.3, -1.5, -1.57, 0.2]}, "payload": None},
    ],
    "deadline": 100.0,
}
JOULES_PER_KWH = 3.6e6


def reported(client: TestClient, **body: Any) -> bytes:
    answer = client.post("/report", json=body)
    assert answer.status_code == 200, answer.text
    return answer.content


def altered(file: bytes, **answer: Any) -> bytes:
    """The page with another answer in it."""
    bundle = attached_to(file)
    changed = Bundle(**{**vars(bundle), "answer": bundle.answer | answer})
    return file.replace(in_html(bundle.packed()).encode(), in_html(changed.packed()).encode())


@pytest.fixture(scope="module")
def html(client: TestClient) -> bytes:
    return reported(client, optimize=move(), costs=COSTS, title="Lift & <turn>")


def test_the_page_says_what_its_documents_say(html: bytes) -> None:
    bundle, text = attached_to(html), html.decode()
    assert bundle.request["goal"] == move()["goal"] and bundle.kind == "optimize"
    electrical = bundle.answer["energy"]["electrical"]
    yearly = electrical["total"] * 2000 * 200 / JOULES_PER_KWH
    for words in (
        f"<strong>{digits(electrical['total'])}</strong> J",
        f"interval {down(electrical['interval']['p5'])} to {up(electrical['interval']['p95'])}",
        f"<td>{digits(yearly)}</td><td>{amount(yearly * 0.25)}</td><td>{digits(yearly * 0.4)}</td>",
        "Lift &amp; &lt;turn&gt;",
        "line plan",
        "<td>not included</td>",
    ):
        assert words in text
    claimed = [each for each in bundle.answer["baselines"] if each["saving"] is not None]
    assert claimed and text.count('class="claimed') == len(claimed)
    least = min(each["saving"] for each in claimed)
    assert f"<b>{percent(least)} less</b>" in text


def test_a_report_agrees_with_itself_and_with_its_request_answered_again(html: bytes) -> None:
    found = checked(html, again=True, request_id="test")
    assert found.agrees
    assert [line.what for line in found.lines][-2:] == ["page", "request answered again"]


def test_what_was_changed_is_found(html: bytes) -> None:
    bundle = attached_to(html)
    energy = bundle.answer["energy"]
    cheaper = energy["electrical"] | {"total": 0.9 * energy["electrical"]["total"]}
    found = checked(altered(html, energy=energy | {"electrical": cheaper}), False, "test")
    assert {line.what for line in found.lines if not line.agrees} == {
        "energy of move",
        "sum of the parts",
        "page",
    }
    page = checked(html.replace(b"not included", b"also included"), False, "test")
    assert [line.what for line in page.lines if not line.agrees] == ["page"]


def test_a_kept_answer_is_reported_on_by_its_id(client: TestClient) -> None:
    answer = client.post("/optimize", json=move()).json()
    bundle = attached_to(reported(client, optimize=move(), answer=answer["id"]))
    assert bundle.answer["id"] == answer["id"]
    assert bundle.answer["energy"] == answer["energy"]
    refused = client.post("/report", json={"cycle": CYCLE, "answer": answer["id"]})
    assert refused.status_code == 422 and "another request" in refused.json()["errors"][0]["msg"]


def test_a_cycle_shows_its_legs(client: TestClient) -> None:
    page = reported(client, cycle=CYCLE)
    bundle, text = attached_to(page), page.decode()
    assert len(bundle.moves) == 3 and checked(page, False, "test").agrees
    assert "One cycle of 2 stops needs" in text
    assert not re.search(r"\d (J|s)\b", text.partition("</p>")[0].rpartition("lead")[2])
    for leg in bundle.answer["legs"]:
        assert digits(leg["electrical"]) in text
    # no price is given
    assert "Not given: price, carbon intensity, shifts per year." in text


def test_a_tool_is_no_part_in_hand(client: TestClient) -> None:
    part = {"mass": 1.0, "com": [0, 0, 0.2]}
    stops = [{"target": {"q": NEAR}, "payload": part}, {"target": {"q": HOME}, "payload": None}]
    asked = {"start": {"q": HOME}, "stops": stops, "closed": False, "tool": "robotiq_2f_85"}
    bundle = attached_to(reported(client, cycle=asked | {"deadline": 100.0}, advice=False))
    assert min(leg["payload_mass"] for leg in bundle.answer["legs"]) > 0
    assert [leg.loaded for leg in course_of(bundle, program_of(bundle)).legs] == [False, True]


def test_changes_that_need_less_are_computed_and_checked(client: TestClient) -> None:
    page = reported(client, optimize=move(), period=6.0, costs=COSTS)
    bundle, text = attached_to(page), page.decode()
    assert bundle.advised is not None
    total = bundle.answer["energy"]["electrical"]["total"] + bundle.advised["waiting"]
    assert bundle.advised["waiting"] > 0
    assert f"with the wait until 6.00\u00a0s, <b>{digits(total)}\u00a0J</b>" in text
    changes = bundle.advised["advice"]
    assert [each["name"] for each in changes] == ["whole_cycle", "brakes"]
    assert text.count("CHF per year</td>") == len(changes)
    found = checked(page, again=True, request_id="test")
    assert found.agrees, found
    again = ["whole_cycle computed again", "brakes computed again"]
    assert [line.what for line in found.lines][-2:] == again
    cheaper = bundle.advised | {"advice": [changes[0] | {"energy": 0.9 * changes[0]["energy"]}]}
    changed = Bundle(**{**vars(bundle), "advised": cheaper})
    forged = page.replace(in_html(bundle.packed()).encode(), in_html(changed.packed()).encode())
    wrong = [line.what for line in checked(forged, True, "test").lines if not line.agrees]
    assert wrong == ["page", again[0]]
    plain = reported(client, optimize=move(), period=6.0, advice=False).decode()
    assert "Changes that save energy" not in plain and "J of waiting" in plain


def test_a_pdf_has_the_same_documents(client: TestClient) -> None:
    pytest.importorskip("typst")
    file = reported(client, optimize=move(), costs=COSTS, format="pdf")
    assert file.startswith(b"%PDF") and len(re.findall(rb"/Type ?/Page\b", file)) == 1
    bundle = attached_to(file)
    assert bundle.costs["price"] == {"value": 0.25, "source": "contract", "letter": "Y"}
    assert checked(file, again=False, request_id="test").agrees


def test_long_names_and_amounts_stay_on_the_page(
    html: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pages of the PDF, drawn as pictures, have white margins."""
    typst = pytest.importorskip("typst")
    compiled, sides, edge = typst.compile, list[bytes](), 13 / 210

    def pictures(file: Path, **options: Any) -> bytes:
        pages = compiled(file, **options | {"format": "png", "ppi": 40})
        sides.extend(pages if isinstance(pages, list) else [pages])
        return b""

    monkeypatch.setattr(typst, "compile", pictures)
    huge = {"value": 1e12, "source": "W" * 120, "letter": "Y"}
    costs = {"price": huge, "carbon": huge, "shifts_per_year": huge, "cycles_per_shift": huge}
    bundle = replace(attached_to(html), title="W" * 120, costs=COSTS | costs)
    pdf(report_of(bundle), bundle)
    for page in sides:
        shown = np.asarray(Image.open(io.BytesIO(page)).convert("L"))
        margin = int(edge * shown.shape[1])
        assert shown[:, :margin].min() == shown[:, -margin:].min() == 255


@pytest.mark.long
def test_where_nothing_keeps_every_limit_no_saving_is_claimed(client: TestClient) -> None:
    # nearly as fast as any motion can be: baselines with rests are too slow, the others break the
    # limit
    body = move(limits={"tcp_speed": 0.05})
    found = client.post("/optimize", json=body).json()
    body |= {"duration": {"max": 1.02 * found["duration"]}}
    page = reported(client, optimize=body).decode()
    bundle = attached_to(page.encode())
    assert all(each["saving"] is None for each in bundle.answer["baselines"])
    assert "no saving is claimed" in page and 'class="claimed' not in page


@pytest.mark.long
def test_a_baseline_that_needs_less_in_its_own_time_is_told(client: TestClient) -> None:
    """Around the post, a motion with rounded via points needs less than the fast motion and its
    wait.
    """
    body = json.loads((ROOT / "examples" / "optimize" / "over_a_post.json").read_text())
    page = reported(client, optimize=body, advice=False)
    answer = attached_to(page).answer
    ways = {each["name"]: each for each in answer["baselines"]}
    rounded = ways["blended"]
    assert rounded["saving"] < 0 < ways["waypoints"]["duration"] - rounded["duration"]
    time, more = digits(rounded["duration"]), percent(-rounded["saving"])
    assert f"until {time}\u00a0s, it needs {more} more than the best baseline" in page.decode()
    waiting = reported(client, optimize=body, answer=answer["id"], period=4.0)
    bundle = attached_to(waiting)
    cycle = answer["energy"]["electrical"]["total"] + bundle.advised["waiting"]
    theirs = cycle + rounded["saving"] * rounded["electrical"]
    assert f"{percent(cycle / theirs - 1)} more than the best baseline" in waiting.decode()


@pytest.mark.parametrize(("regeneration", "goal", "sign"), [(0.0, 0.0, 0), (1.0, 1.2, -1)])
def test_a_motion_without_energy_or_that_gives_some(
    client: TestClient, regeneration: float, goal: float, sign: int
) -> None:
    """A motion at rest without idle power, and one downwards, into a bus that takes energy back."""
    arm = ARM | {"electronics": {"idle_power": 0.0, "regeneration": regeneration}}
    free = {"rotor_inertia": 1e-3, "coulomb": 0.0, "viscous": 0.0, "copper": 1e-3}
    assert client.put("/robots/free", json=arm | {"drives": free}).status_code in (200, 201)
    body = {"robot": "free", "start": {"q": [0.0, 0.0]}, "goal": {"q": [goal, 0.0]}}
    bundle = attached_to(reported(client, optimize=body, period=4.0))
    assert np.sign(bundle.answer["energy"]["electrical"]["total"]) == sign
    assert client.delete("/robots/free").status_code == 204


def test_energies_of_others_follow_from_savings() -> None:
    for ours, theirs in ((80.0, 100.0), (-5.0, 3.0), (-5.0, -4.0), (-3.0, -4.0), (0.0, 0.0)):
        assert their_energy(ours, saving(ours, theirs)) == pytest.approx(theirs)


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"optimize": move(), "cycle": CYCLE},
        {"optimize": move(), "format": "doc"},
        {"optimize": move(), "title": "turned \u202e round"},
        {"optimize": move(), "costs": {"currency": "pounds sterling"}},
    ],
)
def test_other_bodies_are_refused(recorded: TestClient, body: Json) -> None:
    assert recorded.post("/report", json=body).status_code == 422


def test_a_file_without_documents_is_no_report(html: bytes) -> None:
    for file in (b"", b"%PDF-1.7\n", html.replace(b"joulepath_report", b"other")):
        with pytest.raises(NoReport):
            attached_to(file)


def test_numbers_are_rounded_to_the_safe_side() -> None:
    assert (digits(755.7), down(697.96), up(58.11), up(5.861)) == ("756", "697", "58.2", "5.87")
    assert (digits(1239.4), digits(0.0420), digits(-18.4)) == ("1,239", "0.0420", "−18.4")
    assert (digits(4.026e16), down(2.019e-10), digits(-1e-7)) == ("4.03e16", "2.01e−10", "−1.00e−7")
    assert (up(9.5e-9, 1), digits(9.9996e20)) == ("1e−8", "1.00e21")
    assert (counted(1, "move"), counted(1200, "stop")) == ("1 move", "1,200 stops")
    assert (percent(0.0482), percent(0.0769, "up")) == ("4.8\u00a0%", "7.7\u00a0%")


def test_a_cell_that_no_answer_repeats_is_that_of_the_request(client: TestClient) -> None:
    """A worker reads the large body, and the answer leaves the arm out."""
    points = [[4.0 + 0.001 * k, 4.0, 0.1] for k in range(4000)]
    far = {"position": [0.0, 0.0, 0.0], "rotvec": [0.0, 0.0, 0.0]}
    cloud = {"name": "wall", "shape": "points", "points": points, "radius": 0.01, "pose": far}
    page = reported(client, optimize=move(scene={"obstacles": [cloud]}))
    bundle = attached_to(page)
    assert bundle.answer["arm"] is None and len(page) > 10_000
    assert checked(page, again=False, request_id="test").agrees
