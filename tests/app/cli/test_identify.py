"""`joulepath identify`: from files of logs to figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click import Context

from joulepath import load_robot
from joulepath.app.answers.declared import model_of
from joulepath.app.api.identifications.answer import IdentificationResult
from joulepath.app.cli.identify import identify, moves_of, summary_of
from tests.app.cli.console import Here
from tests.identification_logs import csv_of, recorded, truth_of

ROBOT = load_robot("ur5e")
RESULT = model_of(IdentificationResult)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Files of two logs."""
    folder, files = tmp_path_factory.mktemp("logs"), list[str]()
    for seed, moves in ((0, 6), (1, 3)):
        file = folder / f"log{seed}.csv"
        file.write_bytes(csv_of(recorded(ROBOT, truth_of(ROBOT), moves=moves, seed=seed)))
        files.append(str(file))
    return files


def test_logs_become_figures(here: Here, logs: list[str], tmp_path: Path) -> None:
    output = tmp_path / "figures.json"
    code, _, told = here.run("identify", logs[0], "--validate", logs[1], "-o", str(output))
    assert code == 0
    result = RESULT.model_validate_json(output.read_bytes())
    # a command shows the warnings of its logs nowhere else
    assert [each.partition(":")[0] for each in result.warnings] == ["Log log0", "Log log1"]
    assert all("No payload is given" in each for each in result.warnings)
    assert result.validation.moves == 3
    assert "log0" in result.document["friction_laws"]["identified"]["coulomb"]["source"]
    assert b"log1" not in told


def test_a_log_of_the_fit_does_not_validate_it(here: Here, logs: list[str], tmp_path: Path) -> None:
    copy = tmp_path / "copy.csv"
    copy.write_bytes(Path(logs[1]).read_bytes())
    code, content = here.problem("identify", *logs, "--validate", str(copy))
    assert code == 2 and content["errors"][0]["loc"] == ["body", "validate"]


def test_measured_and_predicted_energies_are_a_table(here: Here, tmp_path: Path) -> None:
    fitted, cycles = tmp_path / "monday.csv", tmp_path / "cycles.csv"
    truth = truth_of(ROBOT)
    fitted.write_bytes(csv_of(recorded(ROBOT, truth, moves=6)))
    repeated = recorded(ROBOT, truth, moves=4, seed=1, closed=True, cycles=2)
    cycles.write_bytes(csv_of(repeated))
    logs = ("identify", str(fitted), "--validate", str(cycles), "--payload", "0")
    output = tmp_path / "moves.txt"
    assert here.run(*logs, "--format", "moves", "-o", str(output))[0] == 0
    head, *rows = output.read_text().splitlines()
    assert head.split()[:2] == ["move", "log"]
    assert [row.split()[0] for row in rows] == [*map(str, range(1, 9)), "cycle", "cycle"]


def test_ten_seconds_at_rest_and_a_wattmeter(here: Here, tmp_path: Path) -> None:
    log, output = tmp_path / "rest.csv", tmp_path / "figures.json"
    upright = "0,-1.5708,0,-1.5708,0,0"
    rows = [f"{k / 100},{upright},{30 + (k % 7) / 10}" for k in range(1000)]
    log.write_text("\n".join(["t,q1,q2,q3,q4,q5,q6,P", *rows]))
    command = ("identify", str(log), "--payload", "0", "--mains", "104", "-o", str(output))
    assert here.run(*command)[0] == 0
    result = RESULT.model_validate_json(output.read_bytes())
    assert result.validation is None
    assert result.document["electronics"]["idle_power"]["value"] == pytest.approx(30.3, abs=0.1)
    mains = result.document["mains"]
    assert mains["constant"]["value"] == pytest.approx(104 - 1.1 * 30.3, abs=0.1)
    assert [mains[each]["trust"] for each in ("factor", "constant")] == ["E", "B"]
    assert summary_of(json.loads(output.read_bytes()))["measure next"]
    assert "two different motions" in moves_of(json.loads(output.read_bytes()))
    code, content = here.problem(*command[:-3], "30")
    assert code == 2 and content["errors"][0]["loc"][-1] == "mains"


def test_what_is_found_can_be_chosen(here: Here, logs: list[str], tmp_path: Path) -> None:
    output = tmp_path / "figures.json"
    chosen = (
        "--fit",
        "torque_constant",
        "--fit",
        "friction",
        "--term",
        "coulomb",
        "--term",
        "viscous",
    )
    assert here.run("identify", logs[0], *chosen, "--payload", "0", "-o", str(output))[0] == 0
    result = RESULT.model_validate_json(output.read_bytes())
    found = {each.figure for each in result.parameters}
    # The log has power, so the figures of the power are added by themselves.
    assert found == {
        "torque_constant",
        "coulomb",
        "viscous",
        "idle_power",
        "copper",
        "inverter_linear",
    }


def test_every_field_of_a_request_has_an_option(here: Here, logs: list[str]) -> None:
    """Values out of range are told with the names of their fields, so they have arrived."""
    wrong = {
        "velocity_threshold": "11",
        "prior_weight": "0",
        "period": "0",
        "validate": "0.9",
    }
    options = [part for name, value in wrong.items() for part in (_flag(name), value)]
    code, content = here.problem("identify", logs[0], *options, "--knee", "2")
    places = [each["loc"][1:] for each in content["errors"]]
    assert code == 2
    assert {place[0] for place in places} == {*wrong, "friction"}
    assert ["friction", "knee"] in places
    code, content = here.problem("identify", logs[0], "--deadline", "3601")
    assert content["errors"][0]["loc"] == ["body", "deadline"]


def test_the_options_are_the_fields_of_the_requests() -> None:
    from joulepath.app.api.identifications.request import FrictionTerms, IdentifyRequest
    from joulepath.app.api.logs.request import LogSettings

    names = {each.name for each in identify.get_params(Context(identify))}
    own = {"validate_": "others", "inertials": "refit", "friction": "terms", "name": None}
    told = [*IdentifyRequest.model_fields, *FrictionTerms.model_fields, *LogSettings.model_fields]
    # a command has no names and tags: its files are not stored
    assert {own.get(name, name) for name in told} - {None, "tags"} <= names


def test_each_motion_validates_the_others(here: Here, logs: list[str], tmp_path: Path) -> None:
    output = tmp_path / "figures.json"
    assert here.run("identify", logs[1], "--validate", "moves", "-o", str(output))[0] == 0
    assert RESULT.model_validate_json(output.read_bytes()).validation.moves == 3
    assert here.run("identify", logs[1], "--validate", "moves", "--validate", logs[0])[0] == 2
    code, _, told = here.run("identify", logs[1], "--validate", "no_such.csv")
    assert code == 2 and b"does not exist" in told


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def test_no_log_is_wrong_usage(here: Here) -> None:
    assert here.run("identify")[0] == 2
    assert here.run("identify", "none.csv")[0] == 2


def test_an_unknown_robot_is_named(here: Here, logs: list[str]) -> None:
    code, content = here.problem("identify", logs[0], "--robot", "r2d2")
    assert code == 2 and "ur5e" in json.dumps(content)


def test_options_say_what_a_file_does_not(here: Here, tmp_path: Path) -> None:
    """Options describe a file without header, with currents in mA, of a hanging arm."""
    recording = recorded(ROBOT, truth_of(ROBOT), moves=6)
    file = tmp_path / "log.csv"
    table = np.column_stack([recording.time, recording.q, recording.v, 1e3 * recording.current])
    np.savetxt(file, table, delimiter=",", fmt="%.9g")
    numbers = {"time": 1, "q": [*range(2, 8)], "v": [*range(8, 14)], "current": [*range(14, 20)]}
    options = ("--columns", json.dumps(numbers), "--current-units", "mA", "--payload", "0")
    output = tmp_path / "figures.json"
    assert here.run("identify", str(file), *options, "-o", str(output))[0] == 0
    result = RESULT.model_validate_json(output.read_bytes())
    told = {(each.figure, each.joint) for each in result.parameters if each.identified}
    assert ("coulomb", 1) in told
    code, _, said = here.run("identify", str(file), *options, "--gravity", "0", "0", "9.81")
    assert code != 0 and b"gravity" in said
    code, _, said = here.run("identify", str(file), "--columns", "[1]")
    assert code != 0 and b"mapping" in said
