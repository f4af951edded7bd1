"""POST /optimize: answers keep the promises of the contract."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE
from joulepath.optimizer.result.certificate import Certificate
from tests.app.requests import EXAMPLES, move
from tests.selection import long_but

# tolerance of numbers computed in one place and only passed on
EXACT = 1e-12


# the examples of every run; the test of the OpenAPI document sends the others
QUICK = ("joint_to_pose", "pose_to_pose", "storage_on_the_bus", "over_a_post")


@pytest.fixture(scope="module", params=long_but(QUICK, EXAMPLES))
def asked_and_answered(
    request: pytest.FixtureRequest, client: TestClient
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Every example of the documentation with its answer, checked against the schema."""
    asked = EXAMPLES[request.param]
    answer = client.post("/optimize", json=asked, headers={"X-Request-ID": request.param})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/json"
    # strict, nothing missing, nothing more: the schema is the answer's
    model_of(OptimizeAnswer).model_validate_json(answer.content)
    content: dict[str, Any] = answer.json()
    assert content["request"] == request.param and content["answer"] == f"/answers/{content['id']}"
    return asked, content


def test_echoes_the_settings_in_force(
    asked_and_answered: tuple[dict[str, Any], dict[str, Any]],
) -> None:
    asked, answer = asked_and_answered
    assert answer["robot"] == "ur5e"
    assert answer["method"] == asked.get("method", "bspline")
    assert answer["objective"] == asked.get("objective", "electrical")


def test_trajectory_joins_the_ends(
    asked_and_answered: tuple[dict[str, Any], dict[str, Any]],
) -> None:
    asked, answer = asked_and_answered
    trajectory = {
        name: np.array(values)
        for name, values in answer["trajectory"].items()
        if name != "spline" and values
    }
    samples = len(trajectory["t"])
    assert {values.shape for values in trajectory.values()} == {(samples,), (samples, 6)}
    assert np.diff(trajectory["t"][:-1]) == pytest.approx(0.008)
    assert trajectory["t"][-1] == pytest.approx(answer["duration"])
    for end, at in (("start", 0), ("goal", -1)):
        assert trajectory["q"][at] == pytest.approx(answer["branch"][end]["q"], abs=1e-9)
        assert trajectory["v"][at] == pytest.approx(np.zeros(6), abs=1e-9)
        if "q" in asked[end]:
            assert answer["branch"][end]["q"] == asked[end]["q"]


def test_energy_adds_up(asked_and_answered: tuple[dict[str, Any], dict[str, Any]]) -> None:
    _, answer = asked_and_answered
    energy, objective = answer["energy"], answer["objective"]
    electrical = dict(energy["electrical"])
    total, interval = electrical.pop("total"), electrical.pop("interval")
    assert interval["p5"] < total < interval["p95"]
    assert sum(interval["shares"].values()) == pytest.approx(1.0)
    assert sum(electrical.values()) == pytest.approx(total, rel=Certificate.ENERGY_TOLERANCE)
    assert sum(energy["mechanical"]["per_joint"]) == pytest.approx(energy["mechanical"]["total"])
    if energy["lower_bound"] > 0:
        assert energy["optimality_gap"] == pytest.approx(
            energy[objective]["total"] / energy["lower_bound"] - 1, abs=EXACT
        )
    else:
        assert energy["optimality_gap"] is None
    drawn = total - electrical["dwell"]  # the mean is over the motion
    assert energy["mean_power"] == pytest.approx(drawn / answer["duration"], rel=1e-3)


def test_compares_and_accounts(asked_and_answered: tuple[dict[str, Any], dict[str, Any]]) -> None:
    asked, answer = asked_and_answered
    names = {"trapezoid", "quintic", "ruckig", "ruckig_slowed", "straight", "controller_default"}
    if "path" in asked:
        names = {"even_speed", "quintic"}
    usual = [each for each in answer["baselines"] if each["name"] in names]
    assert {each["name"] for each in usual} == names
    others = {each["name"] for each in answer["baselines"]} - names
    if sum(each["within_limits"] for each in usual) >= 2:
        assert not others
    else:
        assert others <= {"waypoints", "blended"}
        assert sum(each["within_limits"] for each in answer["baselines"]) >= 2
    ours = answer["energy"][answer["objective"]]["total"]
    for baseline in answer["baselines"]:
        assert (baseline["saving"] is None) == (not baseline["within_limits"])
        if baseline["saving"] is not None and baseline["duration"] == answer["duration"]:
            own = 1 - ours / baseline[answer["objective"]]
            assert baseline["saving"] == pytest.approx(own, abs=1e-9)
    chosen = (answer["branch"]["start"]["label"], answer["branch"]["goal"]["label"])
    solved = [entry for entry in answer["candidates"] if entry["status"] == "solved"]
    assert chosen in {(entry["start"], entry["goal"]) for entry in solved}


def test_certificate_holds(asked_and_answered: tuple[dict[str, Any], dict[str, Any]]) -> None:
    _, answer = asked_and_answered
    certificate = answer["certificate"]
    assert max(certificate["worst_ratio"].values()) <= 1 + RATIO_TOLERANCE
    for error in (certificate["start_error"], certificate["goal_error"]):
        assert max(error.values()) <= Certificate.POSITION_TOLERANCE


@pytest.mark.parametrize(
    ("duration", "least", "most"),
    [
        (1.5, 1.5, 1.5),
        ({"min": 2.0}, 2.0, 600),
        ({"max": 0.9}, 0, 0.9),
        ({"min": 1.0, "max": 1.2}, 1.0, 1.2),
        ({}, 0, 600),
    ],
)
def test_keeps_the_duration(client: TestClient, duration: Any, least: float, most: float) -> None:
    answer = client.post("/optimize", json=move(duration=duration)).json()
    assert least - 1e-9 <= answer["duration"] <= most + 1e-9


def test_samples_as_asked(client: TestClient) -> None:
    answer = client.post("/optimize", json=move(sample_period=0.1, duration=0.95)).json()
    assert answer["trajectory"]["t"] == pytest.approx([*np.arange(10) / 10, 0.95])


def test_friction_law_by_name(client: TestClient) -> None:
    requests = [move(duration=1.0, friction=law) for law in (None, "curved", "coulomb_viscous")]
    default, curved, plain = (client.post("/optimize", json=request).json() for request in requests)
    assert default["energy"] == curved["energy"] != plain["energy"]


def test_keeps_to_the_branch(client: TestClient) -> None:
    request = EXAMPLES["joint_to_pose"] | {
        "branch": {"elbow": "down", "wrist": "flip"},
        "candidates": "all",
    }
    answer = client.post("/optimize", json=request).json()
    assert answer["branch"]["goal"]["label"].split("/")[1:] == ["down", "flip"]
    assert {entry["goal"].split("/")[1] for entry in answer["candidates"]} == {"down"}


def test_keeps_tighter_limits(client: TestClient) -> None:
    limits = {"velocity": 0.2, "acceleration": [1, 1, 1, 1, 1, 1], "position": {"lower": -1.6}}
    answer = client.post("/optimize", json=move(limits=limits)).json()
    assert np.abs(answer["trajectory"]["v"]).max() <= 0.2 * (1 + 1e-6)
    assert np.min(answer["trajectory"]["q"]) >= -1.6


def test_a_quaternion_is_normalised(client: TestClient) -> None:
    def goal(scale: float) -> dict[str, Any]:
        quaternion = [0.0, scale, 0.0, 0.0]
        pose = {"position": [-0.35, 0.4, 0.3], "quaternion": quaternion}
        return move(goal={"pose": pose}, windings=False)

    exact, near = (client.post("/optimize", json=goal(scale)).json() for scale in (1.0, 1.0009))
    assert near["branch"]["goal"]["q"] == pytest.approx(exact["branch"]["goal"]["q"], abs=1e-9)
    assert client.post("/optimize", json=goal(1.0011)).status_code == 422


def test_integers_are_numbers(client: TestClient) -> None:
    request = move(start={"q": [0, -1, 1, -1, -1, 0]}, gravity=[0, 0, -10], duration=1)
    assert client.post("/optimize", json=request).status_code == 200
