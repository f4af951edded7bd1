"""Commands of searches: requests from options, answers in files, and output on a terminal."""

from __future__ import annotations

import json
import re
from math import pi
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.answers.declared import model_of
from joulepath.app.api.advice.task import AdviceAnswer
from joulepath.app.api.compare.task import CompareAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.whatif.answer import WhatifAnswer
from joulepath.app.cli import ik, searches
from tests.app.cli.console import Here, request
from tests.app.cli.test_terminal import on_a_terminal
from tests.app.requests import HOME, NEAR, move

FROM = json.dumps(HOME)
TO = "[17.188734,-80.21409,80.21409,-85.943669,-89.954373,11.459156]deg"
DOWN = "p[0.4,-0.2,0.3,2.221441,-2.221441,0]"


def written(here: Here, tmp_path: Path, *arguments: str, stdin: str = "") -> Any:
    """The JSON written to a file by a command."""
    output = tmp_path / "answer.json"
    assert here.run(*arguments, "--output", str(output), stdin=stdin) == (0, b"", b"")
    return json.loads(output.read_bytes())


def test_a_first_move_needs_no_file(here: Here, tmp_path: Path) -> None:
    """The options take joints in radians or degrees, and a pose of URScript."""
    answer = written(here, tmp_path, "optimize", "--robot", "ur5e", "--from", FROM, "--to", TO)
    model_of(OptimizeAnswer).model_validate_json(json.dumps(answer))
    assert answer["trajectory"]["q"][0] == pytest.approx(HOME)
    assert answer["trajectory"]["q"][-1] == pytest.approx(NEAR, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("[0, 1.5]", {"q": [0.0, 1.5]}),
        ("[0, 90]deg", {"q": [0.0, pi / 2]}),
        (" [.5,-1e-1] deg", {"q": [0.5 * pi / 180, -0.1 * pi / 180]}),
        (DOWN, {"pose": {"position": [0.4, -0.2, 0.3], "rotvec": [2.221441, -2.221441, 0.0]}}),
    ],
)
def test_targets_as_pendants_and_programs_write_them(text: str, target: Any) -> None:
    from joulepath.app.cli.motion_request import Target

    found = Target().convert(text, None, None)
    assert found.keys() == target.keys()
    for name, value in target.items():
        assert found[name] == (pytest.approx(value) if name == "q" else value)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "0,1", "p[1,2,3]", DOWN + "deg", "[a]", "p", "{}", "[[1]]", "[nan]", "[1,,2]"],
)
def test_a_target_that_is_none_is_wrong_usage(here: Here, text: str) -> None:
    code, out, err = here.run("optimize", "--from", FROM, "--to", text)
    assert (code, out) == (2, b"")
    assert b"'--to'" in err and b"p[x,y,z,rx,ry,rz]" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("optimize",), b"--from is missing"),
        (("pareto", "--from", FROM), b"--to is missing"),
        (("compare", "-", "--robot", "ur5e"), b"options cannot change"),
        (("ik",), b"--pose is missing"),
        (("ik", "--pose", FROM), b"--pose takes a pose"),
    ],
)
def test_what_is_asked_for_must_be_whole(
    here: Here, arguments: tuple[str, ...], words: bytes
) -> None:
    code, out, err = here.run(*arguments, stdin=request())
    assert (code, out) == (2, b"")
    assert words in err


def test_a_front_with_its_motions(here: Here, tmp_path: Path) -> None:
    """`export` accepts the file of every motion."""
    folder = tmp_path / "new" / "motions"
    body = json.dumps(move(points=2, duration={"max": 2.0}))
    answer = written(here, tmp_path, "pareto", "-", "--answers", str(folder), stdin=body)
    names = {Path(point["answer"]).name for point in answer["points"]}
    assert {file.stem for file in folder.iterdir()} == names
    motion = folder / f"{min(names)}.json"
    code, out, _ = here.run("export", "csv", str(motion))
    assert code == 0 and out.startswith(b"t,q1,")
    lines = searches.pareto_summary(answer)
    first = answer["points"][0]
    assert lines[f"{first['duration']:.4g} s"] == f"{first['energy']:.4g} J electrical"


def test_a_placement_with_its_cycles(here: Here, tmp_path: Path) -> None:
    folder = tmp_path / "cycles"
    stops = [{"name": "there", "target": {"q": NEAR}}]
    cycle = {"start": {"q": HOME}, "stops": stops, "windings": False}
    places = [{"position": [0.1, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]}]
    body = json.dumps({"cycle": cycle, "region": {"places": places}, "deadline": 60})
    answer = written(here, tmp_path, "placement", "-", "--answers", str(folder), stdin=body)
    (own,) = answer["best"]["cycles"]
    kept = json.loads((folder / f"{Path(own['answer']).name}.json").read_text())
    total = kept["energy"]["electrical"]["total"]
    assert total == pytest.approx(answer["best"]["energy"])
    # joint positions do not depend on the place of the base
    assert answer["saving"] == pytest.approx(0.0, abs=1e-6)
    lines = searches.placement_summary(answer)
    assert lines["energy"] == f"{answer['best']['energy']:.4g} J electrical"
    assert lines["saved"] == "0.0%"


def test_a_front_as_csv(here: Here) -> None:
    code, out, err = here.run(
        "pareto", "-", "--format", "csv", stdin=json.dumps(move(points=2, duration={"max": 2.0}))
    )
    assert (code, err) == (0, b"")
    assert out.startswith(b"duration,energy,start,goal,") and len(out.splitlines()) >= 2


def test_compare(here: Here, tmp_path: Path) -> None:
    body = json.dumps(move(methods=["uniform_scaling", "bspline"]))
    answer = written(here, tmp_path, "compare", "-", stdin=body)
    model_of(CompareAnswer).model_validate_json(json.dumps(answer))
    lines = searches.compare_summary(answer)
    assert [*lines] == ["uniform_scaling", "bspline"]
    assert "0.0% above the best" in lines[answer["best"]]


def test_a_change_of_the_arm(here: Here, tmp_path: Path) -> None:
    heavier = {"name": "heavier", "arm": {"payload": {"mass": 3.0, "com": [0, 0, 0.05]}}}
    beyond = {"name": "slower", "arm": {"limits": {"position": {"upper": [0.1] * 6}}}}
    body = json.dumps({"optimize": move(), "changes": [heavier, beyond]})
    answer = written(here, tmp_path, "whatif", "-", stdin=body)
    model_of(WhatifAnswer).model_validate_json(json.dumps(answer))
    lines = searches.whatif_summary(answer)
    assert [*lines] == ["as it is", "heavier", "slower"]
    assert re.fullmatch(r"the same motion [\d.-]+ J, best [\d.-]+ J", lines["heavier"])
    assert lines["slower"] == answer["changes"][1]["problem"]["title"]


def test_advice(here: Here, tmp_path: Path) -> None:
    body = {"optimize": move(), "period": 60.0, "changes": []}
    answer = written(here, tmp_path, "advice", "-", stdin=json.dumps(body))
    model_of(AdviceAnswer).model_validate_json(json.dumps(answer))
    change = {"name": "lighter_tool", "energy": 40.0, "instead_of": 50.0}
    assert searches.advice_summary(answer | {"advice": [change]}) == {
        "as it is": f"{answer['energy']:.4g} J electrical",
        "lighter tool": "40 J instead of 50 J",
    }


def test_a_path_of_the_tool(here: Here, tmp_path: Path) -> None:
    beyond = {"position": [9.0, 0.0, 0.0], "quaternion": [0.0, 1.0, 0.0, 0.0]}
    reached = beyond | {"position": [0.4, -0.2, 0.3]}
    body = {"t": [0.0, 1.0], "poses": [reached, beyond], "guess": HOME}
    answer = written(here, tmp_path, "ik-path", "-", stdin=json.dumps(body))
    assert ik.path_summary(answer) == {"in the trajectory": "1 of 2 points", "unreachable": "1"}


def test_configurations_of_a_pose(here: Here, tmp_path: Path) -> None:
    answer = written(here, tmp_path, "ik", "--robot", "ur5e", "--pose", DOWN)
    lines = ik.summary_of(answer)
    assert lines["configurations"] == str(len(answer["solutions"])) and lines["complete"] == "yes"
    assert len(lines["branches"].split(", ")) == 8


def test_a_table_of_configurations_is_a_motion(here: Here, tmp_path: Path) -> None:
    """Two commands lead from a pose to energies."""
    table = tmp_path / "configurations.csv"
    body = json.dumps({"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}})
    given = ("ik", "-", "--format", "csv", "--output", str(table))
    assert here.run(*given, stdin=body) == (0, b"", b"")
    rows = table.read_text().splitlines()
    assert rows[0] == "q1,q2,q3,q4,q5,q6" and len(rows) > 8
    found = written(here, tmp_path, "evaluate", str(table), "--time-per-segment", "4")
    assert found["segment_count"] == len(rows) - 2


def test_an_excitation(here: Here, tmp_path: Path) -> None:
    fields = {
        "parameters": ["friction"],
        "period": 6,
        "harmonics": 2,
        "starts": 1,
        "deadline": 60,
        "centre": HOME,
    }
    answer = written(here, tmp_path, "excitation", "-", stdin=json.dumps(fields))
    assert searches.excitation_summary(answer)["motions within limits"] == "1 of 1 starts"


def plain(shown: str) -> str:
    return re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]|\r", "", shown)


def test_a_terminal_shows_an_error_in_words() -> None:
    code, answer, shown = on_a_terminal("optimize", "-", stdin=request(colour="red"))
    assert (code, answer) == (2, "")
    lines = plain(shown).splitlines()
    assert lines[0].startswith("Invalid request: ")
    assert any(line.startswith("  colour: ") for line in lines)
    assert not any(line.startswith("{") for line in lines)


def test_a_terminal_shows_what_to_do() -> None:
    code, _, shown = on_a_terminal("ik", "--pose", "p[3,0,0,0,0,0]", stdin="")
    assert code == 1
    text = plain(shown)
    assert text.startswith("Unreachable pose: ")
    assert "Check that `position` is in metres" in text
