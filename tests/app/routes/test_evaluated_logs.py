"""Logs in `POST /evaluate`: every format of `POST /logs`, stored logs, and measured energies."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import EffortNotUsable, InvalidRequest, InvalidTable, Payload, load_robot
from joulepath.app.answers.declared import model_of
from joulepath.app.api.evaluate.task import EvaluateAnswer
from joulepath.app.exceptions.stored import UnknownLog
from joulepath.models.robot import Array
from tests.app.cli.console import run
from tests.app.job_clients import ended
from tests.app.routes.test_problems import refused
from tests.identification_logs import SILENT, Recording, csv_of, recorded, truth_of

ROBOT = load_robot("ur5e")
CARRIED = Payload(1.5, np.array([0.0, 0.02, 0.06]))
TRUTH = truth_of(ROBOT, payload=CARRIED)
CSV = {"Content-Type": "text/csv"}
PAYLOAD = {"mass": CARRIED.mass, "com": CARRIED.com.tolist()}
# relative: integrals over rows 8 ms apart, of the log and of the reader's low-pass filtered grid
SAMPLED = 2e-3
# relative: drives of the unit against the robot's own figures, which differ by some ten per cent
OWN_FIGURES = 0.25
# s: a move begins and ends slowly, and counts once its speed is above the noise
EDGES = 0.15
ABSENT = "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(ROBOT, TRUTH, moves=3, noise=SILENT)


def rtde(made: Recording) -> bytes:
    """A file of Universal Robots' `record.py`: spaces, and voltage and current of the arm's bus."""
    groups = {"actual_q": made.q, "actual_qd": made.v, "actual_current": made.current}
    names = ["timestamp", *(f"{name}_{j}" for name in groups for j in range(6))]
    names += [
        "actual_robot_voltage",
        "actual_robot_current",
        "payload",
        "payload_cog_0",
        "payload_cog_1",
        "payload_cog_2",
    ]
    carried = np.tile([CARRIED.mass, *CARRIED.com], (len(made.time), 1))
    columns = [
        made.time + 7000.0,
        *groups.values(),
        np.full(len(made.time), 48.0),
        made.power / 48.0,
        carried,
    ]
    return table(names, np.column_stack(columns), " ")


def jointstate(made: Recording) -> bytes:
    """A file of PlotJuggler from ROS's JointState, with named joints in another order."""
    order = [2, 1, 0, 3, 4, 5]
    names = ["__time", *(f"/joint_states/{ROBOT.joint_names[j]}/position" for j in order)]
    return table(names, np.column_stack([made.time, made.q[:, order]]), ",")


def table(names: list[str], rows: Array, separator: str) -> bytes:
    lines = [separator.join(names), *(separator.join(f"{x:.9g}" for x in row) for row in rows)]
    return "\n".join(lines).encode()


def evaluated(client: TestClient, body: bytes, **query: str) -> dict[str, Any]:
    answer = client.post("/evaluate", content=body, headers=CSV, params=query)
    assert answer.status_code == 200, answer.text
    model_of(EvaluateAnswer).model_validate_json(answer.content)
    return answer.json()


@pytest.fixture(scope="module")
def stored(client: TestClient, recording: Recording) -> Iterator[str]:
    answer = client.post("/logs", content=rtde(recording), headers=CSV)
    assert answer.status_code == 201, answer.text
    yield answer.json()["id"]
    client.delete(answer.headers["location"])


def test_the_measured_energy_of_each_move_stands_beside_the_models(
    client: TestClient, recording: Recording
) -> None:
    answer = evaluated(client, rtde(recording))
    assert answer["arm"]["payload"]["mass"] == CARRIED.mass, "as the log says"
    assert answer["segment_count"] == len(answer["segments"]) == len(recording.moves), (
        "moves and rests"
    )
    for segment, move in zip(answer["segments"], recording.moves, strict=True):
        assert segment["start"] == pytest.approx(recording.time[move.start], abs=EDGES)
        first, last = np.searchsorted(
            recording.time, [segment["start"] - 1e-6, segment["end"] - 1e-6]
        )
        drawn = np.trapezoid(recording.power[first : last + 1], recording.time[first : last + 1])
        assert segment["measured"]["electrical"] == pytest.approx(drawn, rel=SAMPLED)
        ours = segment["energy"]["electrical"]["total"]
        assert segment["measured"]["by_efforts"] == pytest.approx(ours, rel=OWN_FIGURES)
        assert segment["difference"] == pytest.approx(segment["measured"]["electrical"] / ours - 1)
        interval = segment["energy"]["electrical"]["interval"]
        assert interval["p5"] < ours < interval["p95"]
    whole = np.trapezoid(recording.power, recording.time)
    assert answer["total"]["measured"]["electrical"] == pytest.approx(whole, rel=SAMPLED)
    for name, value in answer["total"]["measured"].items():
        assert sum(segment["measured"][name] for segment in answer["segments"]) == pytest.approx(
            value
        )


def test_the_efforts_of_the_robots_own_figures_make_the_models_energy(
    client: TestClient, recording: Recording
) -> None:
    """The measured energy of the model's own torques equals the energy of the model."""
    model = evaluated(
        client,
        csv_of(recording, without="aiP"),
        payload=json.dumps(PAYLOAD),
        sample_period=f"{1 / recording.rate}",
    )
    rows = len(recording.time)
    torque = np.array(model["samples"]["tau_motor"])[:rows]
    body = table(
        [
            "t",
            *(f"q{j}" for j in range(1, 7)),
            *(f"v{j}" for j in range(1, 7)),
            *(f"tau{j}" for j in range(1, 7)),
        ],
        np.column_stack([recording.time, recording.q, recording.v, torque]),
        ",",
    )
    again = evaluated(client, body, payload=json.dumps(PAYLOAD), effort="torque")
    assert again["total"]["measured"]["electrical"] is None, "no power was logged"
    ours = model["total"]["energy"]["electrical"]["total"]
    assert again["total"]["measured"]["by_efforts"] == pytest.approx(ours, rel=5 * SAMPLED)


@pytest.mark.parametrize(
    "write", [rtde, jointstate, csv_of], ids=["rtde", "joint names", "own, with power"]
)
def test_whatever_is_a_log_is_a_motion(
    client: TestClient, recording: Recording, write: Any
) -> None:
    """All formats give the same motion, to within their digits and derivatives."""
    plain = csv_of(recording, without="iP")
    expected = evaluated(client, plain, payload=json.dumps(PAYLOAD))["total"]["energy"][
        "electrical"
    ]["total"]
    for body in (write(recording), gzip.compress(write(recording))):
        found = evaluated(client, body, payload=json.dumps(PAYLOAD))
        assert found["total"]["energy"]["electrical"]["total"] == pytest.approx(expected, rel=0.02)
        assert found["duration"] == pytest.approx(recording.time[-1], rel=1e-6)


def test_units_of_a_log(client: TestClient, recording: Recording) -> None:
    names = ["time", *(f"{name}_position" for name in ROBOT.joint_names)]
    degrees = table(names, np.column_stack([1e3 * recording.time, np.degrees(recording.q)]), ";")
    found = evaluated(client, degrees, units="deg")
    assert found["duration"] == pytest.approx(recording.time[-1], rel=1e-6), (
        "milliseconds are recognised"
    )
    assert any("ms" in said for said in found["warnings"])
    refused(client.post("/evaluate", content=degrees, headers=CSV), InvalidTable)


def test_a_stored_log_brings_its_arm(client: TestClient, recording: Recording, stored: str) -> None:
    answer = client.post("/evaluate", json={"log": stored})
    assert answer.status_code == 200, answer.text
    model_of(EvaluateAnswer).model_validate_json(answer.content)
    by_file = evaluated(client, rtde(recording))
    assert answer.json()["total"] == by_file["total"] and answer.json()["arm"] == by_file["arm"]
    other = client.post("/evaluate", json={"log": stored, "payload": None}).json()
    assert other["total"]["energy"] != by_file["total"]["energy"] and not (other["arm"] or {}).get(
        "payload"
    )


def test_a_stored_log_in_other_requests(client: TestClient, stored: str) -> None:
    alone = client.post("/evaluate", json={"log": stored}).json()["total"]["energy"]["electrical"][
        "total"
    ]
    sent = client.post("/jobs", json={"requests": [{"evaluate": {"log": stored}}]})
    (done,) = ended(client, sent.headers["location"])["requests"]
    assert done["energy"] == alone, done["problem"]
    study = client.post("/studies", json={"name": "log", "threshold": 1.0}).headers["location"]
    assert (
        client.post(f"{study}/iterations", json={"evaluate": {"log": stored}}).json()["energy"]
        == alone
    )
    empty = {"name": "empty", "arm": {"payload": None}}
    changed = client.post("/whatif", json={"evaluate": {"log": stored}, "changes": [empty]})
    assert changed.status_code == 200, changed.text
    assert changed.json()["base"]["electrical"]["total"] == alone
    (row,) = changed.json()["changes"]
    assert row["same_motion"]["electrical"]["total"]["value"] < alone, "without what it carried"


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ({"robot": "ur10e"}, ["body", "robot"]),
        ({"time_per_segment": 1.0}, ["body"]),
        ({"trajectory": {"t": [0.0, 1.0], "q": [[0.0] * 6] * 2}}, ["body"]),
    ],
    ids=["another robot", "times", "two motions"],
)
def test_contradictions_are_refused(
    client: TestClient, stored: str, body: Any, loc: list[str]
) -> None:
    content = refused(client.post("/evaluate", json={"log": stored, **body}), InvalidRequest)
    assert [error["loc"] for error in content["errors"]] == [loc]


@pytest.mark.parametrize("id", [ABSENT, "none", "", "x" * 36])
def test_an_absent_log_is_unknown(client: TestClient, id: str) -> None:
    refused(client.post("/evaluate", json={"log": id}), UnknownLog)


def test_efforts_that_say_nothing_do_not_stop_it(client: TestClient, recording: Recording) -> None:
    """Nothing can be identified from such efforts; the energy of the motion does not need them."""
    body = table(
        ["t", *(f"q{j}" for j in range(1, 7)), *(f"i{j}" for j in range(1, 7))],
        np.column_stack([recording.time, recording.q, np.ones_like(recording.q)]),
        ",",
    )
    refused(client.post("/logs", content=body, headers=CSV), EffortNotUsable)
    found = evaluated(client, body)
    assert found["total"]["measured"] is None and any(
        "never change" in said for said in found["warnings"]
    )


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("a,b\n1,2\n3,4\n", 1),
        ("", None),
        ("time,x\n0,1\n", 1),
        ("t,q1,q2\n0,1,2\n", 1),
        ("timestamp,actual_q_0\n", 1),
    ],
    ids=["no names", "empty", "no positions", "too few joints", "too few joints of RTDE"],
)
def test_what_is_neither_says_what_is_missing(
    client: TestClient, text: str, row: int | None
) -> None:
    content = refused(client.post("/evaluate", content=text, headers=CSV), InvalidTable)
    assert content["row"] == row


def test_the_table_has_the_measured_energies(client: TestClient, recording: Recording) -> None:
    answer = client.post(
        "/evaluate", content=rtde(recording), headers={**CSV, "Accept": "text/csv"}
    )
    head, *rows = answer.text.splitlines()
    column = head.split(",").index("measured.electrical")
    measured = [float(row.split(",")[column]) for row in rows]
    assert (
        sum(measured[:-1]) == pytest.approx(measured[-1]) and len(rows) == len(recording.moves) + 1
    )
    low, high = (head.split(",").index(f"electrical.interval.{end}") for end in ("p5", "p95"))
    assert all(float(row.split(",")[low]) < float(row.split(",")[high]) for row in rows)


@pytest.mark.long
def test_a_log_that_repeats_has_cycles(client: TestClient, tmp_path: Path) -> None:
    repeated = recorded(ROBOT, TRUTH, moves=4, seed=2, closed=True, cycles=3)
    answer = client.post("/evaluate", content=rtde(repeated), headers=CSV)
    found: Any = model_of(EvaluateAnswer).model_validate_json(answer.content)
    assert len(found.cycles) == 3 and len(found.segments) == len(repeated.moves)
    for cycle in found.cycles:
        inside = [each for each in found.segments if cycle.start <= each.start < cycle.end]
        for name in ("electrical", "by_efforts"):
            parts = [getattr(each.measured, name) for each in inside]
            assert getattr(cycle.measured, name) == pytest.approx(sum(parts))
        interval = cycle.energy.electrical.interval
        assert interval.p5 < cycle.energy.electrical.total < interval.p95
        assert cycle.difference is not None
    file = tmp_path / "log.csv"
    file.write_bytes(rtde(repeated))
    rows = run("evaluate", str(file), "--format", "moves").stdout.decode().splitlines()
    assert [row[:7] for row in rows[-4:]] == ["cycle 1", "cycle 2", "cycle 3", "total  "]
