"""`joulepath export` and `joulepath report`: the files of the service, and its refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.app.cli.console import ROOT as PROJECT
from tests.app.cli.console import Here, run
from tests.app.recorded import CYCLE
from tests.app.requests import move

ANSWER = json.loads((PROJECT / "examples" / "export" / "urscript" / "slow_run.json").read_text())[
    "answer"
]


@pytest.fixture
def answer(tmp_path: Path) -> str:
    file = tmp_path / "answer.json"
    file.write_text(json.dumps(ANSWER))
    return str(file)


def test_a_motion_is_written_with_the_options_of_its_format(
    here: Here, answer: str, tmp_path: Path
) -> None:
    output = tmp_path / "slow.script"
    options = (
        "--speed-scale",
        "0.1",
        "--set",
        "form=points",
        "--set",
        "rate=125",
        "--output",
        str(output),
    )
    assert here.run("export", "urscript", answer, *options)[0] == 0
    text = output.read_text()
    assert (
        "slowed down to 0.1 of its speed" in text
        and "t=0.008" in text
        and "jp_piece(0.0" not in text
    )


def test_an_altered_answer_is_a_problem_and_wrong_usage_is_told(here: Here, answer: str) -> None:
    altered = json.dumps({**ANSWER, "arm": {"payload": {"mass": 3.0, "com": [0.0, 0.0, 0.0]}}})
    code, content = here.problem("export", "csv", "-", stdin=altered)
    assert (code, content["type"]) == (1, "/problems/not-certified")
    code, content = here.problem("export", "csv", "-", stdin="")
    assert (code, content["type"]) == (2, "/problems/invalid-request")
    code, content = here.problem(
        "export", "csv", "-", stdin=json.dumps({"robot": "ur5e", "legs": []})
    )
    assert (code, content["type"]) == (2, "/problems/invalid-request")
    leg = {
        "kind": "move",
        "start": {"stop": "a"},
        "goal": {"stop": "b"},
        "duration": 1.0,
        "answer": "/answers/none",
    }
    code, content = here.problem(
        "export", "csv", "-", stdin=json.dumps({"robot": "ur5e", "legs": [leg]})
    )
    assert (code, content["type"]) == (1, "/problems/unknown-answer")
    for wrong in (("--set", "form"), ("--speed-scale", "x")):
        assert here.run("export", "urscript", answer, *wrong)[0] == 2
    assert here.run("export", "json", answer, "--set", "form=points")[0] == 2


def test_a_cycle_is_exported_and_replayed_without_a_database(here: Here, tmp_path: Path) -> None:
    moves, cycle, table = (tmp_path / name for name in ("moves", "cycle.json", "cycle.csv"))
    request = json.dumps(CYCLE)
    written = ("--answers", str(moves), "--output", str(cycle))
    assert here.run("cycle", "-", *written, stdin=request)[0] == 0
    code, content = here.problem("export", "csv", str(cycle))
    assert (code, content["type"]) == (1, "/problems/unknown-answer")
    exported = ("export", "csv", str(cycle), "--answers", str(moves), "--output", str(table))
    assert here.run(*exported)[0] == 0
    last = table.read_text().splitlines()[-1].split(",")
    assert float(last[0]) == pytest.approx(json.loads(cycle.read_text())["duration"])
    options = ("--answers", str(moves), "--control", "pd", "--step", "1e-3")
    code, replayed, _ = here.run("replay", str(cycle), *options)
    assert code == 0 and len(json.loads(replayed)["motions"]) == len(list(moves.iterdir())) == 2


def test_a_report_is_written_and_checked(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    costs = ("--price", "0.2:contract", "--shifts-per-year", "460")
    written = run("report", "-", *costs, "--output", str(page), stdin=json.dumps(move()))
    assert written.returncode == 0, written.stderr
    assert "contract" in page.read_text() and "460 shifts per year" in page.read_text()
    whole = run("check", str(page))
    assert whole.returncode == 0, whole.stderr
    assert b"DIFFERS" not in whole.stdout and b"request answered again" in whole.stdout
    page.write_text(page.read_text().replace("460 shifts", "46 shifts"))
    changed = run("check", str(page), "--no-answer")
    assert changed.returncode == 1 and b"DIFFERS  page" in changed.stdout


def test_other_files_are_refused(here: Here, tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no report")
    code, _, err = here.run("check", str(text))
    assert code == 2 and b"not a report of joulepath" in err
    code, _, err = here.run("report", str(text), "--output", str(tmp_path / "report.doc"))
    assert code == 2 and b".html or .pdf" in err
    code, _, err = here.run("report", str(text), "--robot", "ur5e", "--output", "report.html")
    assert code == 2 and b"for a log" in err
    code, _, err = here.run("report", str(text), "--price", "cheap", "--output", "report.html")
    assert code == 2 and b"NUMBER:SOURCE" in err
