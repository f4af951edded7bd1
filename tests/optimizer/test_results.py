"""Methods of results for notebooks and scripts, on small real results."""

from __future__ import annotations

import json
import pickle
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import joulepath
from tests.identification_logs import csv_of, recorded, truth_of
from tests.optimizer.placement.cells import at

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = START + 0.3


@cache
def problem() -> joulepath.Problem:
    scene = joulepath.Scene(
        [
            joulepath.Obstacle("post", joulepath.Cylinder(0.05, 0.4), at(z=-0.9)),
            joulepath.Obstacle("wall", joulepath.HalfSpace(), at(z=-1.5)),
        ]
    )
    arm = joulepath.Arm(robot=joulepath.load_robot("ur5e"), scene=scene)
    return joulepath.Problem(arm=arm, start=START, goal=GOAL, windings=False, deadline=100.0)


@cache
def result(name: str) -> Any:
    if name == "Solution":
        return joulepath.optimize(problem())
    if name == "Evaluation":
        return joulepath.evaluate(problem().arm, result("Solution"), sample_period=0.01)
    if name == "Comparison":
        return joulepath.compare(
            replace(problem(), duration_max=2.0), ["uniform_scaling", "bspline"]
        )
    if name == "Front":
        asked = replace(problem(), objective="mechanical", method="time_scaling", duration_max=2.0)
        return joulepath.pareto(asked, 2)
    if name == "WhatIf":
        heavier = replace(problem().arm, payload=joulepath.Payload(mass=3.0))
        return joulepath.what_if(result("Solution"), replace(problem(), arm=heavier))
    if name == "IKSolutions":
        pose = joulepath.Pose.from_rotvec([0.4, -0.2, 0.3], [np.pi, 0.0, 0.0])
        return joulepath.inverse_kinematics(problem().arm, pose, windings=False)
    if name == "Replay":
        return joulepath.replay(
            result("Solution"), step=2e-3, perturb={"friction": 0.3}, problem=problem()
        )
    if name == "Identification":
        robot = problem().arm.robot
        content = csv_of(recorded(robot, truth_of(robot), moves=4))
        options = joulepath.LogOptions(payload=joulepath.Payload())
        return joulepath.identify(robot, [joulepath.read_log(content, robot, options).log])
    if name == "PlacementSolution":
        pose = joulepath.Pose.from_rotvec([0.4, -0.2, 0.3], [np.pi, 0.0, 0.0])
        return joulepath.place(
            replace(cycle(), stops=[joulepath.Stop(name="pick", target=pose)]),
            joulepath.Places([at(z=0.01)]),
        )
    return joulepath.plan_cycle(cycle())


def cycle() -> joulepath.Cycle:
    stops = [
        joulepath.Stop(name="pick", target=GOAL, dwell=0.2, payload=joulepath.Payload(mass=2.0)),
        joulepath.Stop(name="place", target=START - 0.2, payload=joulepath.Payload()),
    ]
    return joulepath.Cycle(
        arm=problem().arm, start=START, stops=stops, windings=False, deadline=100.0
    )


DRAWN = [
    "Solution",
    "Evaluation",
    "Comparison",
    "Front",
    "CycleSolution",
    "WhatIf",
    "PlacementSolution",
]
TABLES = ["IKSolutions", "Replay", "Identification"]
ALL = DRAWN + TABLES
LONGEST_REPR = 200


@pytest.mark.parametrize("name", ALL)
def test_its_text_is_one_short_line(name: str) -> None:
    text = repr(result(name))
    assert text.startswith(f"{name}(") and text.endswith(")")
    assert len(text) < LONGEST_REPR and "\n" not in text


def test_the_text_has_the_figures() -> None:
    solution = result("Solution")
    text = repr(solution)
    assert f"{solution.energy.electrical.total:.4g} J electrical" in text
    assert f"{solution.duration:.4g} s" in text and solution.status in text
    assert "2 motions" in repr(result("Front")) and "mechanical" in repr(result("Front"))
    assert "pick → place" in repr(result("CycleSolution"))
    assert repr(problem().arm.robot) == "Robot('ur5e', 6 joints, payload up to 5 kg)"
    assert repr(solution.trajectory.spline).startswith("Spline(6 joints, ")
    assert len(repr(solution.trajectory.spline)) < LONGEST_REPR


@pytest.mark.parametrize("name", ALL)
def test_its_html_is_a_table(name: str) -> None:
    html = ElementTree.fromstring(result(name)._repr_html_())
    rows = html.findall("./table/tbody/tr")
    titles = html.findall("./table/thead/tr/th")
    assert rows and all(len(row) == len(titles) for row in rows)


@pytest.mark.parametrize("name", DRAWN)
def test_its_html_has_a_picture(name: str) -> None:
    """It is well-formed, and every curve has its full number of points."""
    html = ElementTree.fromstring(result(name)._repr_html_())
    namespace = "{http://www.w3.org/2000/svg}"
    curves = html.findall(f"./{namespace}svg/{namespace}polyline")
    assert len(curves) >= 1
    for curve in curves:
        numbers = [float(each) for each in curve.attrib["points"].replace(",", " ").split()]
        assert np.isfinite(numbers).all() and len(numbers) >= 4


def test_the_parts_of_the_html_add_up() -> None:
    html = ElementTree.fromstring(result("Solution")._repr_html_())
    cells = [[cell.text for cell in row] for row in html.findall("./table/tbody/tr")]
    *parts, total, _ = [float(row[1] or "nan") for row in cells]
    assert sum(parts) == pytest.approx(total, rel=1e-2)


@pytest.mark.parametrize("name", ALL)
def test_its_dictionary_is_json(name: str) -> None:
    found = result(name).to_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_the_dictionary_is_as_the_service_answers() -> None:
    solution = result("Solution")
    found = solution.to_dict()
    assert found["energy"]["electrical"]["total"] == solution.energy.electrical.total
    assert found["energy"]["lower_bound"] == solution.lower_bound
    assert found["trajectory"]["spline"]["knots"] == solution.trajectory.spline.knots.tolist()
    assert found["candidate_counts"]["solved"] >= 1
    assert "rest_error" not in found["certificate"]
    cycle = result("CycleSolution").to_dict()
    assert cycle["order"] == ["pick", "place"]
    assert sum(leg["duration"] for leg in cycle["legs"]) == pytest.approx(cycle["duration"])


@pytest.mark.parametrize("name", ALL)
def test_a_saved_result_is_the_same_when_it_is_loaded(name: str, tmp_path: Path) -> None:
    file, saved = tmp_path / "result.json", result(name)
    saved.save(file)
    loaded = type(saved).load(file)
    assert loaded == saved
    assert loaded.to_dict() == saved.to_dict()


def test_a_loaded_solution_serves_like_a_new_one(tmp_path: Path) -> None:
    result("Solution").save(tmp_path / "solution.json")
    loaded = joulepath.Solution.load(tmp_path / "solution.json")
    exported = joulepath.export(loaded, "csv", problem=problem())
    assert (
        exported.content == joulepath.export(result("Solution"), "csv", problem=problem()).content
    )
    heavier = replace(problem().arm, payload=joulepath.Payload(mass=3.0))
    found = joulepath.what_if(loaded, replace(problem(), arm=heavier))
    assert found.same_motion.mechanical.total > loaded.energy.mechanical.total


@pytest.mark.parametrize(
    "content", ["", "{}", "[1]", '{"class": "Front"}', '{"class": "Solution"}']
)
def test_a_file_of_something_else_is_refused(content: str, tmp_path: Path) -> None:
    file = tmp_path / "other.json"
    file.write_text(content)
    with pytest.raises(ValueError, match=r"other\.json is not a Solution.*json\.load"):
        joulepath.Solution.load(file)


@pytest.mark.parametrize("name", ALL)
def test_it_is_the_same_after_pickling(name: str) -> None:
    assert pickle.loads(pickle.dumps(result(name))) == result(name)


def test_results_of_other_motions_differ() -> None:
    assert result("IKSolutions") != replace(result("IKSolutions"), complete=False)
    assert result("Replay") != replace(result("Replay"), duration=1.0)
    solution = result("Solution")
    spline = solution.trajectory.spline
    moved = replace(spline, control_points=spline.control_points + 1e-12)
    assert moved != spline
    other = replace(solution, trajectory=replace(solution.trajectory, spline=moved))
    assert other != solution and solution != result("Evaluation")
    assert solution.energy == replace(solution.energy)
    assert solution.start != solution.goal


class Frames:
    """A stand-in for a package of data frames that keeps the columns."""

    @staticmethod
    def DataFrame(columns: dict[str, Any]) -> dict[str, Any]:
        assert len({len(column) for column in columns.values()}) == 1
        return columns


@pytest.mark.parametrize("package", ["pandas", "polars"])
@pytest.mark.parametrize("name", ALL)
def test_its_table_has_columns_of_one_length(
    name: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, package, Frames)  # type: ignore[arg-type]
    columns = result(name).to_frame()
    assert columns
    if name == "Solution":
        assert {"t", "q1", "tau_motor6", "power"} <= columns.keys()
        assert columns["q3"] == pytest.approx(result(name).trajectory.q[:, 2])


def test_what_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("pandas", "polars", "matplotlib.pyplot"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match="pandas or polars"):
        result("Solution").to_frame()
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'joulepath\[plot\]'"):
        result("Solution").plot()


def test_nothing_is_drawn_without_samples() -> None:
    found = joulepath.evaluate(problem().arm, result("Solution"))
    with pytest.raises(ValueError, match="a `sample_period`"):
        found.plot()
    assert "svg" not in found._repr_html_()


@pytest.mark.parametrize("name", TABLES)
def test_a_table_has_no_curves_to_draw(name: str) -> None:
    with pytest.raises(ValueError, match="no curves to draw"):
        result(name).plot()


@pytest.mark.parametrize("name", DRAWN)
def test_its_plot_has_all_curves(name: str) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure = result(name).plot()
    try:
        assert all(axes.lines and axes.get_xlabel() for axes in figure.axes)
        if name == "Solution":
            positions, power = figure.axes
            assert len(positions.lines) == 6 and len(power.lines) == 1
    finally:
        pyplot.close(figure)


def test_texts_of_callers_are_escaped() -> None:
    cycle = result("CycleSolution")
    first = cycle.moves[0]
    named = replace(first, planned=replace(first.planned, goal="<b>pick</b>"))
    html = replace(cycle, moves=[named, *cycle.moves[1:]])._repr_html_()
    assert "<b>pick</b>" not in html and "&lt;b&gt;pick&lt;/b&gt;" in html
