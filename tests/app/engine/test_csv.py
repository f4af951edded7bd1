"""Tables of answers as CSV."""

from __future__ import annotations

from joulepath.app.engine.result import csv_document


def test_a_spreadsheet_computes_no_name() -> None:
    names = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "a=b", ""]
    lines = csv_document([["n", "name"], *([-1.5, name] for name in names)]).decode().splitlines()
    assert lines[1:] == [*(f"-1.5,'{name}" for name in names[:4]), "-1.5,a=b", "-1.5,"]
