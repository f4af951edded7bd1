"""The console command as a process: answers, problems, exit codes."""

from __future__ import annotations

import json
import re
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from joulepath.app.answers.declared import model_of
from joulepath.app.api.evaluate.task import EvaluateAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.cli.main import main
from joulepath.app.settings import Settings
from tests.app.cli.console import CSV, CSV_OPTIONS, ROOT, Here, request, run
from tests.app.requests import NEAR


def test_optimize_answers_as_the_service_does(tmp_path: Path) -> None:
    file = tmp_path / "request.json"
    file.write_text(request())
    finished = run("optimize", str(file), cwd=tmp_path)
    assert (finished.returncode, finished.stderr) == (0, b"")
    answer = model_of(OptimizeAnswer).model_validate_json(finished.stdout)
    assert answer.status == "optimal"
    assert answer.trajectory.q[-1] == pytest.approx(NEAR)


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ("{", ["body"]),
        ("", ["body"]),
        (b"\xff\xfe", ["body"]),
        (request().replace("-1.57", "NaN", 1), ["body", "start", "q", 1]),
        (request(limits={"velocity": 1e300}), ["body", "limits", "velocity"]),
        (request(limits={"velocity": -1.0}), ["body", "limits", "velocity"]),
        (request(deadline=1e9), ["body", "deadline"]),
        (request(colour="red"), ["body", "colour"]),
    ],
)
def test_an_invalid_request_is_a_validation_problem(
    here: Here, body: str | bytes, loc: list[str | int]
) -> None:
    code, content = here.problem("optimize", "-", stdin=body)
    assert (code, content["type"]) == (2, "/problems/invalid-request")
    assert [error["loc"] for error in content["errors"]] == [loc]


def test_a_valid_request_without_a_motion_exits_with_1(here: Here) -> None:
    code, content = here.problem("optimize", "-", stdin=request(limits={"torque": 1.0}))
    assert (code, content["type"]) == (1, "/problems/torque-infeasible")


@pytest.mark.parametrize("command", ["optimize", "cycle", "evaluate"])
def test_a_file_that_does_not_exist_is_wrong_usage(here: Here, command: str) -> None:
    code, out, err = here.run(command, "no/such/file.json")
    assert (code, out) == (2, b"")
    assert b"'no/such/file.json' does not exist" in err


def test_an_output_that_cannot_be_written_is_wrong_usage(here: Here, tmp_path: Path) -> None:
    code, out, err = here.run(
        "optimize", "-", "--output", str(tmp_path / "no" / "answer.json"), stdin=request()
    )
    assert (code, out) == (2, b"")
    assert b"answer.json" in err
    assert b"Traceback" not in err


def test_evaluate_takes_a_csv_with_options_and_settings(here: Here, tmp_path: Path) -> None:
    settings, output = tmp_path / "settings.json", tmp_path / "answer.json"
    settings.write_text(
        json.dumps({"payload": {"mass": 2.0, "com": [0, 0, 0.05]}, "time_per_segment": 9.0})
    )
    given = (
        "evaluate",
        str(CSV),
        *CSV_OPTIONS,
        "--interpolation",
        "linear",
        "--output",
        str(output),
    )
    energies = []
    for more in ((), ("--settings", str(settings))):
        assert here.run(*given, *more) == (0, b"", b"")
        answer = model_of(EvaluateAnswer).model_validate_json(output.read_bytes())
        # The option, not the file, sets 1.5 s for both segments.
        assert answer.duration == pytest.approx(3.0)
        energies.append(answer.total.energy.electrical.total)
    assert energies[1] > energies[0]


def test_evaluate_writes_a_csv_table(here: Here, tmp_path: Path) -> None:
    output = tmp_path / "energies.csv"
    options = ("--input", "csv", "--format", "csv", "--output", str(output))
    assert here.run("evaluate", "-", *CSV_OPTIONS, *options, stdin=CSV.read_bytes()) == (
        0,
        b"",
        b"",
    )
    head, *rows = output.read_text().splitlines()
    assert head.startswith("segment,")
    assert [row.partition(",")[0] for row in rows] == ["1", "2", "total"]


@pytest.mark.parametrize(
    ("arguments", "stdin", "kind"),
    [
        (("-",), "[]", "invalid-request"),
        (("-", "--input", "csv"), "q1,q2\n1,nan\n", "invalid-table"),
        (("-", "--input", "csv", "--robot", "r2d2"), CSV.read_bytes(), "unknown-robot"),
        (("-", "--input", "csv", "--sample-period", "nan"), CSV.read_bytes(), "invalid-request"),
        (
            ("-", "--input", "csv", "--units", "deg"),
            CSV.read_bytes(),
            "invalid-request",
        ),  # no time_per_segment
    ],
)
def test_an_invalid_motion_is_a_problem(
    here: Here, arguments: tuple[str, ...], stdin: str | bytes, kind: str
) -> None:
    code, content = here.problem("evaluate", *arguments, stdin=stdin)
    assert (code, content["type"]) == (2, f"/problems/{kind}")


def test_options_for_a_csv_do_not_go_with_json(here: Here, tmp_path: Path) -> None:
    code, _, err = here.run("evaluate", "-", "--units", "deg", stdin="{}")
    assert code == 2
    assert b"--units is for a CSV" in err
    settings = tmp_path / "settings.json"
    settings.write_text("[1]")
    code, _, err = here.run("evaluate", str(CSV), "--settings", str(settings))
    assert code == 2
    assert b"one JSON object" in err


@pytest.mark.long
def test_robots_are_listed_with_their_trust() -> None:
    finished = run("robots")
    assert (finished.returncode, finished.stderr) == (0, b"")
    head, *rows = finished.stdout.decode().splitlines()
    assert re.split(r"\s{2,}", head)[:4] == ["name", "title", "joints", "payload [kg]"]
    cells = re.split(r"\s{2,}", next(row for row in rows if row.startswith("ur5e ")))
    assert cells[1:4] == ["Universal Robots UR5e", "6", "5"]
    # Copper loss comes from a sister robot, and the T tells every reader so.
    assert "T" in cells[6]


@pytest.mark.parametrize(
    "command",
    [
        "",
        "serve",
        "optimize",
        "cycle",
        "compare",
        "evaluate",
        "excitation",
        "ik",
        "jobs",
        "pareto",
        "replay",
        "robots",
        "robots add",
        "robots remove",
        "whatif",
    ],
)
def test_every_help_has_an_example_that_exists(here: Here, command: str) -> None:
    code, out, _ = here.run(*command.split(), "--help")
    assert code == 0
    text = out.decode()
    assert re.search(rf"Examples?:\n\s+(echo .*\n.*)?(\S.*)?joulepath {command}", text)
    assert all((ROOT / file).is_file() for file in re.findall(r"examples/\S+\.json", text))
    if not command:
        assert all(
            re.search(rf"^\s+{code}  \S", text, re.MULTILINE) for code in (0, 1, 2, 130, 141)
        )


def test_serve_takes_host_and_port(here: Here, monkeypatch: pytest.MonkeyPatch) -> None:
    """The options become the settings of the service; the test of the wheel starts a real
    service.
    """
    served: list[tuple[str, int]] = []

    def record() -> None:
        settings = Settings()
        served.append((settings.host, settings.port))

    monkeypatch.setattr("joulepath.app.__main__.main", record)
    # monkeypatch undoes the changes of the command
    monkeypatch.setenv("JOULEPATH_HOST", "203.0.113.7")
    monkeypatch.setenv("JOULEPATH_PORT", "1")
    assert here.run("serve")[0] == 0
    assert here.run("serve", "--host", "127.0.0.1", "--port", "8080")[0] == 0
    assert served == [("203.0.113.7", 1), ("127.0.0.1", 8080)]


def test_an_installation_has_the_command() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    (command,) = project["scripts"].items()
    assert EntryPoint(*command, group="console_scripts").load() is main
