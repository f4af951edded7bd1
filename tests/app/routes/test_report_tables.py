"""POST /report on a job and on a log: sums, tables, and the findings of the check."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.api.report.bundle import Bundle, attached_to, in_html
from joulepath.app.api.report.check import checked
from joulepath.app.api.report.drawings import DRAWING, Course, Leg, Stop, drawn
from joulepath.app.api.report.log_report import measured
from joulepath.app.api.report.numbers import digits, percent
from joulepath.app.tasks import job_document
from joulepath.optimizer.problem.robots import load_robot
from tests.app import job_clients as jobs
from tests.app.job_clients import evaluation, optimization
from tests.app.requests import move
from tests.app.routes.test_report import CYCLE
from tests.identification_logs import csv_of, recorded, truth_of

ROBOT = load_robot("ur5e")
# places are written with one digit
ROUNDING = 0.11
CSV = {"Content-Type": "text/csv"}


def reported(client: TestClient, **body: Any) -> bytes:
    answer = client.post("/report", json=body)
    assert answer.status_code == 200, answer.text
    return answer.content


@pytest.fixture(scope="module")
def job(client: TestClient) -> str:
    """Two motions, an impossible one, a request without a motion of its own, and a cycle."""
    requests = [
        optimization(1.0) | {"name": "bin to shelf"},
        optimization(2.0) | {"name": "shelf *<to>* bin"},
        {"optimize": move(duration=0.01)},
        evaluation(),
        {"cycle": CYCLE},
    ]
    path = jobs.sent(client, requests, name="Night run")
    ended = jobs.ended(client, path)
    assert ended["counts"]["done"] == 4, client.get(f"{path}/results").text
    return path.rpartition("/")[2]


@pytest.fixture(scope="module")
def page(client: TestClient, job: str) -> bytes:
    return reported(client, job=job, costs={"price": {"value": 0.2}})


@pytest.fixture(scope="module")
def log(client: TestClient) -> str:
    """A log of an arm off the robot's figures, with its true power."""
    body = csv_of(recorded(ROBOT, truth_of(ROBOT), moves=3))
    answer = client.post("/logs", content=body, params={"name": "morning"}, headers=CSV)
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def test_a_job_is_summed_and_listed(page: bytes) -> None:
    text, rows = page.decode(), attached_to(page).moves
    answers = [row["answer"] for row in rows if row["kind"] != "evaluate" and row["answer"]]
    totals = [answer["energy"]["electrical"]["total"] for answer in answers]
    bounds = sum(answer["energy"]["lower_bound"] for answer in answers)
    assert len(totals) == 3 and bounds <= sum(totals)
    assert f"<b>{digits(sum(totals))}\u00a0J</b> in total" in text and "<h1>Night run</h1>" in text
    for name in ("bin to shelf", "shelf *&lt;to&gt;* bin"):
        assert f"<td>{name}</td>" in text
    assert "most energy: shelf ∗&lt;to&gt;∗ bin," in text, "the stars of a name mark nothing"
    for total in totals:
        assert f"<td>{digits(total)}</td>" in text
    assert '<td colspan="7" class="remark">' in text, "the motion that cannot be says why"
    assert "no motion" in text and "1 of 5 moves has no answer" in text


def test_savings_of_a_job_are_those_of_its_moves(page: bytes) -> None:
    """The savings sum up the best baseline of every move, and no other."""
    text, rows = page.decode(), attached_to(page).moves
    ours = theirs = 0.0
    for row in rows:
        answer = row["answer"]
        if row["kind"] == "evaluate" or answer is None:
            continue
        savings = [each["saving"] for each in answer["baselines"] if each["saving"] is not None]
        if not savings:
            continue
        own = answer["energy"]["electrical"]["total"]
        ours, theirs = ours + own, theirs + own / (1 - min(savings))
        assert f"<td>{percent(min(savings))}</td>" in text
    assert ours, "some of these moves have a baseline within the limits"
    saving = 1 - ours / theirs
    assert (f"<b>{percent(saving)} less</b> than" in text) == (saving >= 0.0005)


def test_a_job_too_large_for_the_memory_is_refused(
    client: TestClient, job: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_document, "LARGEST_DOCUMENT", 10_000)
    answer = client.post("/report", json={"job": job})
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"]
    assert error["loc"] == ["body", "job"] and "GET /jobs/{id}/results" in error["msg"]
    table = client.get(f"/jobs/{job}/results", headers={"Accept": "text/csv"})
    assert table.status_code == 200 and len(table.text.splitlines()) == 6


def test_a_job_is_checked_row_by_row(page: bytes) -> None:
    found = checked(page, again=True, request_id="test")
    assert found.agrees, found
    whats = [line.what for line in found.lines]
    assert whats[:4] == ["limits", "energy of no. 1", "energy of no. 2", "sum of the rows"]
    assert whats[-3:] == [f"no. {k} answered again" for k in (1, 2, 5)]
    bundle = attached_to(page)
    one = bundle.moves[0]["answer"]
    cheaper = one["energy"]["electrical"] | {"total": 0.9 * one["energy"]["electrical"]["total"]}
    row = bundle.moves[0] | {"answer": one | {"energy": one["energy"] | {"electrical": cheaper}}}
    changed = Bundle(**{**vars(bundle), "moves": [row, *bundle.moves[1:]]})
    forged = page.replace(in_html(bundle.packed()).encode(), in_html(changed.packed()).encode())
    wrong = {line.what for line in checked(forged, False, "test").lines if not line.agrees}
    assert wrong == {"energy of no. 1", "sum of the rows", "page"}


def test_a_job_without_a_motion_has_no_report(client: TestClient) -> None:
    path = jobs.sent(client, [evaluation()])
    jobs.ended(client, path)
    answer = client.post("/report", json={"job": path.rpartition("/")[2]})
    assert answer.status_code == 422 and "needs a job with motions" in answer.text
    assert client.post("/report", json={"job": "no-such-job"}).status_code == 404


def test_a_log_is_measured_against_predicted(client: TestClient, log: str) -> None:
    page = reported(client, evaluate={"log": log})
    text, answer = page.decode(), attached_to(page).answer
    assert "<h1>morning</h1>" in text and len(answer["segments"]) == answer["segment_count"]
    found = measured(answer["total"])
    assert found is not None and found[0] == "electrical"
    assert f"drew <b>{digits(found[1])}\u00a0J</b> according to the logged power" in text
    more = "more" if answer["total"]["difference"] >= 0 else "less"
    assert f"<b>{percent(abs(answer['total']['difference']))} {more}</b>" in text
    for part in answer["segments"]:
        drawn = part["measured"]["electrical"]
        likely = part["energy"]["electrical"]["interval"]
        within = "yes" if likely["p5"] <= drawn <= likely["p95"] else "no"
        assert f"<td>{digits(drawn)}</td>" in text and f"<td>{within}</td>" in text
    assert "Energy costs" not in text and 'aria-label="The cell"' not in text


def test_a_report_of_a_log_holds_the_log(client: TestClient, log: str) -> None:
    """The check reads the log from the file alone, after its deletion from the database."""
    page = reported(client, evaluate={"log": log})
    pdf = reported(client, evaluate={"log": log}, format="pdf") if _typst() else page
    assert client.delete(f"/logs/{log}").status_code == 204
    for file in (page, pdf):
        found = checked(file, again=True, request_id="test")
        assert found.agrees, found
        whats = [line.what for line in found.lines]
        assert {"predicted, again", "measured from power, again"} <= set(whats)
    assert client.post("/report", json={"evaluate": {"log": log}}).status_code == 404


def _typst() -> bool:
    return pytest.importorskip("typst") is not None


def test_pages_of_a_table_repeat_its_head(client: TestClient, job: str) -> None:
    pytest.importorskip("typst")
    file = reported(client, job=job, format="pdf")
    assert file.startswith(b"%PDF")
    assert checked(file, again=False, request_id="test").agrees


def test_numbers_of_stops_do_not_cover_each_other() -> None:
    """Numbers of stops keep their distance, and none is left out if there is room for it."""
    for count, shown in ((9, 9), (200, 40)):
        stops = [Stop((k + 0.5) / count, k + 1, False) for k in range(count)]
        legs = [Leg(k / 2, 0.5, 1.0, False, False) for k in range(2)]
        text = drawn(Course(1.0, [0.0, 1.0], [1.0, 1.0], legs, stops))
        places = [float(x) for x in re.findall(r'<circle cx="([0-9.]+)"', text)]
        assert len(places) >= shown and min(np.diff(places)) >= 2 * DRAWING.stop - ROUNDING
