"""`joulepath identify`: from files of logs to figures."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.schemas import errors as problems
from app.schemas.identifications import IdentificationResult
from models.registry import load_robot
from tests.app.cli.console import Here
from tests.identification_logs import csv_of, recorded, truth_of

ROBOT = load_robot("ur5e")


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
    code, _, told = here.run("identify", logs[0], "--validate", logs[1], "--payload", "0", "-o", str(output))
    assert code == 0
    result = IdentificationResult.model_validate_json(output.read_bytes())
    assert result.validation.moves == 3
    assert "log0" in result.document["friction_laws"]["identified"]["coulomb"]["source"]
    assert b"log1" not in told


def test_a_log_of_one_motion_is_a_problem(here: Here, tmp_path: Path) -> None:
    file = tmp_path / "one.csv"
    file.write_bytes(csv_of(recorded(ROBOT, truth_of(ROBOT), moves=1)))
    code, content = here.problem("identify", str(file), "--payload", "0")
    assert code == 1
    problems.NothingHeldOut.model_validate(content)


def test_no_log_is_wrong_usage(here: Here) -> None:
    assert here.run("identify")[0] == 2
    assert here.run("identify", "none.csv")[0] == 2


def test_an_unknown_robot_is_named(here: Here, logs: list[str]) -> None:
    code, content = here.problem("identify", logs[0], "--robot", "r2d2")
    assert code == 2 and "ur5e" in json.dumps(content)
