"""The scripts in examples/library run, and their output keeps the promises of the library."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples" / "library"
# energies are printed with one digit [J]
ROUNDED = 0.1
# tolerance of the certificate's ratios, and of four printed digits
RATIO = 1 + 1e-6 + 5e-5


@pytest.fixture
def printed(request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]) -> str:
    """The output of the script in the test's parameter."""
    runpy.run_path(str(FOLDER / f"{request.param}.py"), run_name="__main__")
    return capsys.readouterr().out


def number(pattern: str, text: str) -> float:
    """The number in the group of a pattern."""
    found = re.search(pattern, text)
    assert found, text
    return float(found[1])


def test_every_script_has_a_test() -> None:
    tested = Path(__file__).read_text()
    assert all(f'"{script.stem}"' in tested for script in FOLDER.glob("*.py"))


@pytest.mark.parametrize("printed", ["joints_to_joints"], indirect=True)
def test_joints_to_joints(printed: str) -> None:
    energy = number(r"optimal: (\S+) J", printed)
    assert number(r"less than (\S+) J", printed) < energy
    assert number(r"limit: (\S+)", printed) <= RATIO
    feasible = re.findall(r"^\w+: (\S+) J in \S+ s, within all limits$", printed, re.MULTILINE)
    assert feasible
    assert all(float(baseline) > energy - ROUNDED for baseline in feasible)


@pytest.mark.parametrize("printed", ["several_targets"], indirect=True)
def test_several_targets(printed: str) -> None:
    assert re.search(r"^optimal: place [123] of 3, by branch \S+$", printed, re.MULTILINE)
    assert number(r"margins: (\S+) mm", printed) >= 0
    solved, candidates = map(int, re.findall(r"(\d+) of (\d+) candidates", printed)[0])
    assert 0 < solved < candidates


@pytest.mark.parametrize("printed", ["recording_and_lighter_links"], indirect=True)
def test_recording_and_lighter_links(printed: str) -> None:
    recorded, optimised, same, again = (
        number(rf"{title}[^:]*: (\S+) J", printed)
        for title in ("recorded", "optimised", "the same", "re-optimised")
    )
    assert again <= same < optimised < recorded
    assert "limits that it violates: none" in printed


@pytest.mark.long
def test_pareto_front(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "front.png"
    monkeypatch.setattr(sys, "argv", ["pareto_front", str(picture)])
    runpy.run_path(str(FOLDER / "pareto_front.py"), run_name="__main__")
    rows = re.findall(r"^(\S+) s: (\S+) J, bound (\S+) J$", capsys.readouterr().out, re.MULTILINE)
    durations, energies, bounds = (list(map(float, column)) for column in zip(*rows, strict=True))
    assert len(rows) > 2
    assert durations == sorted(durations)
    assert energies == sorted(energies, reverse=True)
    assert all(bound <= energy for bound, energy in zip(bounds, energies, strict=True))
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_many_moves() -> None:
    """The script is run as by a user: its child processes import it."""
    name = "many_moves"
    told = subprocess.run(
        [sys.executable, "-m", f"examples.library.{name}"],
        capture_output=True,
        text=True,
        cwd=FOLDER.parents[1],
    )
    assert told.returncode == 0, told.stderr
    assert len(re.findall(r"^\d of 6: \d+\.\d J$", told.stdout, re.MULTILINE)) == 6
    assert "cheapest (" in told.stdout
