"""`joulepath report` and `joulepath check`: what one writes, the other computes again."""

from __future__ import annotations

import json
from pathlib import Path

from tests.app.cli.console import Here, run
from tests.app.requests import move


def test_a_report_is_written_and_checked(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    costs = ("--price", "0.2:contract", "--shifts-per-year", "460")
    written = run("report", "-", *costs, "--output", str(page), stdin=json.dumps(move()))
    assert written.returncode == 0, written.stderr
    assert "contract" in page.read_text() and "460 shifts a year" in page.read_text()
    whole = run("check", str(page))
    assert whole.returncode == 0, whole.stderr
    assert b"DIFFERS" not in whole.stdout and b"request answered anew" in whole.stdout
    page.write_text(page.read_text().replace("460 shifts", "46 shifts"))
    changed = run("check", str(page), "--no-answer")
    assert changed.returncode == 1 and b"DIFFERS  page" in changed.stdout


def test_other_files_are_refused(here: Here, tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no report")
    code, _, err = here.run("check", str(text))
    assert code == 2 and b"no report of joulepath" in err
    code, _, err = here.run("report", str(text), "--output", str(tmp_path / "report.doc"))
    assert code == 2 and b".html or .pdf" in err
    code, _, err = here.run("report", str(text), "--robot", "ur5e", "--output", "report.html")
    assert code == 2 and b"for a log" in err
    code, _, err = here.run("report", str(text), "--price", "cheap", "--output", "report.html")
    assert code == 2 and b"NUMBER:SOURCE" in err
