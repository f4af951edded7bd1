"""POST /export/{format} of every kind of answer; altered answers, wrong robots, wrong bodies."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
import yaml
from starlette.testclient import TestClient

from joulepath import FormatUnsuitable, InvalidRequest, NotCertified, UnknownRobot, load_robot
from joulepath.app.exceptions.stored import UnknownAnswer
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.export.export import FORMATS
from tests.app.requests import HOME, NEAR, move
from tests.app.routes.test_problems import refused
from tests.app.test_openapi_examples import DOCUMENT
from tests.optimizer.export.read_back.urscript_machine import Controller
from tests.selection import long_but

Json = dict[str, Any]
LOAD = {"mass": 2.0, "com": [0.0, 0.0, 0.05]}
BOX = {
    "name": "box",
    "shape": "box",
    "size": [0.2, 0.2, 0.2],
    "pose": {"position": [-0.6, -0.6, 0.2], "rpy": [0, 0, 0]},
}
EVIL = "pick\"] end # ' {x}; $(reboot)"
LINES = {
    "approach": {"direction": [0, 0, 1], "distance": 0.04, "speed": 0.2},
    "limits": {"velocity": 1.5, "tcp_speed": 0.5},
    "obstacles_ignored": ["box"],
}
CYCLE = {
    "start": {"q": HOME},
    "stops": [
        {"name": EVIL, "target": {"q": NEAR}, "payload": LOAD, "dwell": 0.2, **LINES},
        {"name": "place", "target": {"q": [0.5, -1.3, 1.3, -1.5, -1.57, 0.2]}, "payload": None},
    ],
    "scene": {"obstacles": [BOX]},
    "deadline": 100.0,
}


@pytest.fixture(scope="module")
def answer(client: TestClient) -> Json:
    return client.post("/optimize", json=move(payload=LOAD, scene={"obstacles": [BOX]})).json()


def export(client: TestClient, format: str, answer: Any, **fields: Any) -> Any:
    return client.post(f"/export/{format}", json={"answer": answer, **fields})


SLOW = {"joint_limits", "mcap"}
"""Formats that take seconds, and have tests of their own."""


def altered(answer: Json, *path: Any, value: Any) -> Json:
    changed = copy.deepcopy(answer)
    *outer, last = path
    part = changed
    for name in outer:
        part = part[name]
    part[last] = value
    return changed


@pytest.mark.parametrize("format", long_but(FORMATS.keys() - SLOW, FORMATS))
def test_a_kept_answer_is_exported_as_it_is_when_sent_whole(
    client: TestClient, answer: Json, format: str
) -> None:
    names = answer["answer"].removeprefix("/answers/"), answer["answer"], answer
    by_id, by_path, whole = (export(client, format, each) for each in names)
    if format in ("franka", "rapid", "krl"):
        # other makers
        assert refused(by_id, FormatUnsuitable)["format"] == format
        return
    assert by_id.status_code == 200, by_id.text
    if format != "npz":  # its archive holds the time
        assert by_id.content == by_path.content == whole.content
    assert by_id.headers["content-disposition"].startswith('attachment; filename="joulepath-ur5e.')
    assert float(by_id.headers["joulepath-worst-ratio"]) <= 1 + 1e-6
    assert "Not tested on hardware" in by_id.headers["joulepath-notes"]


def test_the_document_describes_every_format(client: TestClient) -> None:
    (parameter,) = DOCUMENT["paths"]["/export/{format}"]["post"]["parameters"]
    # lists of equal order: datamodel-code-generator refuses a document with any other form
    described = dict(
        zip(parameter["schema"]["enum"], parameter["schema"]["x-enum-descriptions"], strict=True)
    )
    assert described == {name: each.meaning for name, each in FORMATS.items()}


def test_a_slow_run_is_certified_anew_and_says_so(client: TestClient, answer: Json) -> None:
    fast, slow = (
        export(client, "urscript", answer["answer"], speed_scale=scale) for scale in (1.0, 0.1)
    )
    assert slow.headers["joulepath-speed-scale"] == "0.1"
    assert "speed-0.1" in slow.headers["content-disposition"]
    assert "slowed down to 0.1 of its speed, certified" in slow.text
    assert float(slow.headers["joulepath-worst-ratio"]) < float(
        fast.headers["joulepath-worst-ratio"]
    )


def test_the_program_of_a_cycle_runs_from_stop_to_stop(client: TestClient) -> None:
    found = client.post("/cycle", json=CYCLE).json()
    exported = export(client, "urscript", found, urscript={"digital_output": 1})
    assert exported.status_code == 200, exported.text
    controller = Controller(np.array(HOME))
    controller.run(exported.text)
    assert [event[1:] for event in controller.events if event[0] == "output"] == [
        (1, True),
        (1, False),
    ]
    assert [event[1] for event in controller.events if event[0] == "payload"] == [0.0, 2.0, 0.0]
    assert np.abs(controller.q - HOME).max() < 1e-9
    slow = yaml.safe_load(export(client, "ros2", found, speed_scale=0.5).text)
    end = slow["trajectory"]["points"][-1]["time_from_start"]
    rests = sum(leg["duration"] for leg in found["legs"] if leg["kind"] in ("dwell", "wait"))
    assert end["sec"] + end["nanosec"] * 1e-9 == pytest.approx(
        rests + 2 * (found["duration"] - rests), abs=1e-6
    )


@pytest.mark.parametrize("dwell", [0.0, 0.2])
def test_the_program_of_an_open_cycle_puts_down_what_it_carried(
    client: TestClient, dwell: float
) -> None:
    place = {"name": "place", "target": {"q": NEAR}, "payload": None, "dwell": dwell}
    tool = {"tool": "suction_cup", "payload": LOAD}
    found = client.post(
        "/cycle",
        json=tool | {"start": {"q": HOME}, "stops": [place], "closed": False, "deadline": 100.0},
    ).json()
    assert found["payload_at_end"] == {"mass": 0.0}
    controller = Controller(np.array(HOME))
    controller.run(export(client, "urscript", found, urscript={"digital_output": 1}).text)
    assert [event[1:] for event in controller.events if event[0] == "output"] == [(1, False)]
    carried, left = [event[1] for event in controller.events if event[0] == "payload"]
    assert carried - left == pytest.approx(LOAD["mass"]) and left > 0, "the tool stays"


def test_an_evaluated_motion_is_exported_by_its_samples(client: TestClient) -> None:
    body = {"configurations": [HOME, NEAR], "time_per_segment": 3.0, "payload": LOAD}
    evaluated = client.post("/evaluate", json=body | {"sample_period": 0.1}).json()
    assert evaluated["within_limits"]
    exported = export(client, "ros2", evaluated)
    assert exported.status_code == 200, exported.text
    last = yaml.safe_load(exported.text)["trajectory"]["points"][-1]
    assert last["positions"] == pytest.approx(NEAR) and last["time_from_start"] == {
        "sec": 3,
        "nanosec": 0,
    }
    without = client.post("/evaluate", json=body).json()
    assert "sample_period" in refused(export(client, "ros2", without), InvalidRequest)["detail"]


def test_an_iteration_of_a_study_and_a_point_of_a_front(client: TestClient) -> None:
    study = client.post("/studies", json={"name": "exports", "threshold": 1.0}).json()["id"]
    step = client.post(f"/studies/{study}/iterations", json={"optimize": move()}).json()
    assert export(client, "json", step["answer"]).status_code == 200
    front = client.post("/pareto", json=move(points=2)).json()
    assert export(client, "json", front["points"][0]["answer"]).status_code == 200
    assert "points" in refused(export(client, "json", front), InvalidRequest)["detail"]


SPLINE = ("trajectory", "spline")


@pytest.mark.parametrize(
    ("path", "change"),
    [
        ((*SPLINE, "control_points", 5, 2), lambda x: x + 0.01),
        ((*SPLINE, "knots"), lambda knots: [0.5 * each for each in knots]),
        (("trajectory", "q", 20, 1), lambda x: x + 1e-3),
        (("trajectory", "tau", 20, 1), lambda x: x + 1.0),
        (("trajectory", "t", 20), lambda x: x + 1e-3),
        (("arm", "payload", "mass"), lambda x: 1.9),
        (("arm", "gravity"), lambda x: [0.0, 0.0, 9.81]),
        (("robot",), lambda x: "ur10e"),
    ],
)
def test_an_answer_altered_by_hand_is_not_exported(
    client: TestClient, answer: Json, path: Any, change: Any
) -> None:
    before: Any = answer
    for name in path[:-1]:
        before = before[name]
    old = before.get(path[-1]) if isinstance(before, dict) else before[path[-1]]
    refused(export(client, "urscript", altered(answer, *path, value=change(old))), NotCertified)


def test_an_obstacle_in_the_way_is_not_driven_through(client: TestClient, answer: Json) -> None:
    in_the_way = {"obstacles": [BOX | {"pose": {"position": [-0.5, -0.15, 0.4], "rpy": [0, 0, 0]}}]}
    told = refused(
        export(client, "csv", altered(answer, "arm", "scene", value=in_the_way)), NotCertified
    )
    assert "box" in told["detail"]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ((*SPLINE, "control_points", 0, 0), None),
        ((*SPLINE, "control_points", 0, 0), "NaN"),
        ((*SPLINE, "control_points", 0), [0.0]),
        ((*SPLINE, "knots"), [0.0] * 12),
        ((*SPLINE, "knots"), [1.0, 0.0, 1.0, 0.0]),
        ((*SPLINE, "degree"), 4),
        ((*SPLINE, "degree"), 10**9),
        (("trajectory", "spline"), None),
        (("robot",), ["ur5e"]),
        (("arm",), {"payload": {"mass": -1}}),
    ],
)
def test_an_answer_of_another_form_names_the_field(
    client: TestClient, answer: Json, path: Any, value: Any
) -> None:
    told = refused(export(client, "csv", altered(answer, *path, value=value)), InvalidRequest)
    assert told["errors"][0]["loc"][:2] == ["body", "answer"]


def test_unknown_answers_and_robots(client: TestClient, answer: Json) -> None:
    for unknown in ("nope", "/answers/0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55", "../robots", ""):
        refused(export(client, "csv", unknown), UnknownAnswer)
    refused(export(client, "csv", altered(answer, "robot", value="r2d2")), UnknownRobot)


def test_an_answer_without_its_arm_needs_one(client: TestClient, answer: Json) -> None:
    bare = altered(answer, "arm", value=None)
    assert refused(export(client, "csv", bare), InvalidRequest)["errors"][0]["loc"] == [
        "body",
        "arm",
    ]
    assert export(client, "csv", bare, arm=answer["arm"]).status_code == 200
    refused(
        export(client, "csv", bare, arm={"payload": {"mass": 3.0, "com": [0, 0, 0]}}), NotCertified
    )
    refused(export(client, "csv", bare, arm={**answer["arm"], "robot": "ur3e"}), InvalidRequest)


def test_a_robot_of_seven_joints_gets_the_formats_that_remain(client: TestClient) -> None:
    q = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8]
    found = client.post(
        "/optimize", json=move(robot="fr3", start={"q": q}, goal={"q": [0.2, *q[1:]]})
    ).json()
    told = refused(export(client, "urscript", found), FormatUnsuitable)
    assert told["format"] == "urscript" and "use ros2" in told["detail"]
    assert export(client, "ros2", found).status_code == 200


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"speed_scale": 0.0}, "speed_scale"),
        ({"speed_scale": 1.5}, "speed_scale"),
        ({"ros2": {}}, "ros2"),
        ({"urscript": {"rate": 250}}, "urscript"),
        ({"urscript": {"digital_output": 8}}, "urscript"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_wrong_options_are_named(
    client: TestClient, answer: Json, fields: Json, field: str
) -> None:
    told = refused(export(client, "urscript", answer["answer"], **fields), InvalidRequest)
    assert any(field in map(str, error["loc"]) or field in error["msg"] for error in told["errors"])


def test_a_controllers_name_cannot_hold_a_command(client: TestClient, answer: Json) -> None:
    refused(
        export(client, "ros2", answer["answer"], ros2={"controller": "x; rm -rf /"}), InvalidRequest
    )


def test_an_unknown_format_names_the_known_ones(client: TestClient, answer: Json) -> None:
    told = refused(client.post("/export/gcode", json={"answer": answer["answer"]}), InvalidRequest)
    assert "urscript" in told["errors"][0]["msg"]


def test_accept_chooses_json_where_no_option_says(client: TestClient, answer: Json) -> None:
    body, headers = {"answer": answer["answer"]}, {"accept": "application/json"}
    assert (
        client.post("/export/ros2", json=body, headers=headers).json()["op"] == "send_action_goal"
    )
    yaml_wanted = body | {"ros2": {"encoding": "yaml"}}
    told = client.post("/export/ros2", json=yaml_wanted, headers=headers)
    assert told.headers["content-type"].startswith("application/yaml")


def test_an_arm_of_a_users_own_gets_programs_of_any_maker(client: TestClient) -> None:
    urdf = urdf_of("irb", load_robot("ur3e").figures)
    added = client.put(
        "/robots/irb", json={"urdf": urdf, "tip": "flange", "acceleration": 8.0, "payload": 3.0}
    )
    assert added.is_success, added.text
    found = client.post("/optimize", json=move(robot="irb", collisions=False)).json()
    options = {"signs": [1, -1, 1, 1, 1, 1], "offsets": [0.0, 90.0, 0.0, 0.0, 0.0, 0.0]}
    exported = export(client, "rapid", found["answer"], rapid=options)
    assert exported.status_code == 200 and exported.text.startswith("MODULE Joulepath"), (
        exported.text
    )
    client.delete("/robots/irb")
    refused(export(client, "csv", found), UnknownRobot)


@pytest.mark.parametrize("factor", [1e-300, 1e-9, 1e4])
def test_absurd_durations_are_refused(client: TestClient, answer: Json, factor: float) -> None:
    knots = [factor * each for each in answer["trajectory"]["spline"]["knots"]]
    absurd = altered(answer, *SPLINE, "knots", value=knots)
    refused(export(client, "urscript", absurd), NotCertified)


def test_a_slow_table_has_a_bounded_number_of_rows(client: TestClient, answer: Json) -> None:
    told = export(client, "csv", answer["answer"], speed_scale=0.01, table={"period": 1e-4})
    assert refused(told, FormatUnsuitable)["format"] == "csv"


def test_an_arm_too_large_to_be_repeated_is_sent_with_the_export(client: TestClient) -> None:
    points = {
        "name": "cloud",
        "shape": "points",
        "radius": 0.01,
        "pose": {"position": [5, 0, 0], "rpy": [0, 0, 0]},
    }
    cloud = points | {"points": [[0.0, 0.001 * k, 0.0005 * k] for k in range(4000)]}
    arm = {"payload": LOAD, "scene": {"obstacles": [cloud]}}
    found = client.post("/optimize", json=move(**arm)).json()
    assert found["arm"] is None
    refused(export(client, "csv", found["answer"]), InvalidRequest)
    assert export(client, "csv", found["answer"], arm=arm).status_code == 200
    assert export(client, "csv", found, arm=arm).status_code == 200
