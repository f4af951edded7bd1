"""The client of the API, against the service in this process."""

from __future__ import annotations

import json
import pickle
import sys
from collections.abc import Sequence
from typing import Any

import httpx2
import numpy as np
import pytest
from starlette.testclient import TestClient

import joulepath
from joulepath.app.client.errors import error_of
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.queue import ShuttingDown
from joulepath.app.exceptions.stored import UnknownJob
from joulepath.app.http.problems import path_of, problem_of
from joulepath.optimizer.exceptions import OutsideLimits
from tests.app.live import LOCAL
from tests.app.requests import HOME, NEAR, move


@pytest.fixture
def service(client: TestClient) -> joulepath.Client:
    return joulepath.Client(LOCAL, http=client)


def test_it_optimizes_as_the_service_does(service: joulepath.Client) -> None:
    """A request may be a dictionary, fields, or both, with arrays."""
    whole = service.optimize(move())
    parts = service.optimize(move(), goal={"q": np.array(NEAR)})
    assert whole["energy"]["electrical"]["total"] == parts["energy"]["electrical"]["total"]
    assert service.get(whole["answer"])["id"] == whole["id"]
    assert service.export(whole["id"], "csv").startswith(b"t,q1,")


def test_it_has_the_functions_of_the_library(service: joulepath.Client) -> None:
    """The functions have the same names; many problems are a job, and shapes are data."""
    own = {"optimize_many", "capsule_between", "even_payload"}
    public = {name: getattr(joulepath, name) for name in joulepath.__all__}
    functions = {name for name in public if name.islower()} - own
    assert functions >= {"optimize", "replay", "load_tool"}
    assert {name for name in functions if not hasattr(service, name)} == set()
    # the service also has arms that other tests have stored
    bundled = joulepath.robot_names()
    assert tuple(name for name in service.robot_names() if name in bundled) == bundled
    assert service.tool_names() == joulepath.tool_names()
    robot = joulepath.load_robot("ur10e")
    assert service.load_robot("ur10e")["joints"] == list(robot.joint_names)
    assert service.mjcf("ur10e") == joulepath.mjcf(robot)
    light = joulepath.Arm(robot=robot, payload=joulepath.Payload(mass=1.0))
    limits = service.joint_limits("ur10e", mass=1.0, prefix="left_")
    assert limits == joulepath.joint_limits(light).to_yaml("left_")
    tool = service.load_tool(joulepath.tool_names()[0])
    assert tool["name"] == joulepath.tool_names()[0]


def test_it_reports_and_advises(service: joulepath.Client) -> None:
    found = service.optimize(move())
    page = service.report(optimize=move(), answer=found["id"])
    assert page.startswith(b"<!") and b"J" in page
    assert service.advice(optimize=move(), period=6.0, changes=[])["waiting"] is not None


def test_it_evaluates_and_inverts(service: joulepath.Client) -> None:
    found = service.evaluate(configurations=[HOME, NEAR], time_per_segment=1.5)
    assert found["duration"] == pytest.approx(1.5)
    pose = {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}
    assert len(service.inverse_kinematics(pose=pose, windings=False)["solutions"]) == 8


def test_an_error_is_the_library_s_own(service: joulepath.Client) -> None:
    with pytest.raises(joulepath.UnreachablePose, match="reach") as caught:
        service.inverse_kinematics(pose={"position": [3, 0, 0], "quaternion": [0, 1, 0, 0]})
    assert caught.value.distance is not None and caught.value.distance > 1
    with pytest.raises(joulepath.UnknownRobot) as unknown:
        service.optimize(move(robot="r2d2"))
    assert "ur5e" in unknown.value.known
    with pytest.raises(joulepath.InvalidRequest) as invalid:
        service.optimize(move(colour="red"))
    assert [each["loc"] for each in invalid.value.errors] == [["body", "colour"]]
    assert isinstance(invalid.value, joulepath.ServiceError)
    assert "\ncolour: Unknown field" in str(invalid.value)


def test_every_problem_becomes_its_error() -> None:
    for kind in types_of_error():
        document = {"type": path_of(kind), "title": kind.title, "status": kind.status}
        error = error_of(
            document | {"detail": "Said by the service.", "instance": "7", "names": ["a"]}
        )
        assert isinstance(error, kind) and type(error).type_of_error() is kind
        assert isinstance(error, joulepath.JoulepathError)
        assert str(error) == "Said by the service."
        assert vars(error)["names"] == ["a"]
        again = pickle.loads(pickle.dumps(error))
        assert isinstance(again, kind) and str(again) == str(error)


def test_the_message_is_that_of_the_service() -> None:
    """The message is kept even if it has data absent from every document."""
    error = OutsideLimits("goal", "elbow", 7.0, -3.0, 3.0)
    told = error_of(json.loads(json.dumps(problem_of(error, "7"))))
    assert str(told) == str(error)
    assert isinstance(told, OutsideLimits) and told.upper == 3.0


def test_a_job_from_begin_to_end(service: joulepath.Client) -> None:
    requests = [{"evaluate": {"configurations": [HOME, NEAR], "time_per_segment": 1.5}}] * 2
    sent = service.send_job(requests, name="two")
    looks = list[Any]()
    job = service.wait_for_job(sent["id"], period=0.05, tell=looks.append)
    assert job["state"] == "done" and looks[-1] == job
    assert any(each["id"] == sent["id"] for each in service.jobs())
    results = [*service.job_results(sent["id"])]
    assert [each["index"] for each in results] == [0, 1]
    assert len(service.job_table(sent["id"]).splitlines()) == 3
    assert service.retry_job(sent["id"])["state"] == "done"
    assert service.rename(f"/jobs/{sent['id']}", "both")["name"] == "both"
    service.delete_job(sent["id"])
    with pytest.raises(joulepath.ServiceError, match="job") as caught:
        service.job(sent["id"])
    assert caught.value.slug() == "unknown-job"


def test_a_wait_outlasts_a_restart_of_the_service() -> None:
    """The wait fails if the service never answers or stays away, or the job is deleted."""
    stopping = problem_of(ShuttingDown(), "7")
    going = httpx2.Response(200, json={"state": "running"})
    away: list[httpx2.Response | Exception]
    away = [httpx2.ConnectError("refused"), httpx2.Response(503, json=stopping)]
    gone = httpx2.Response(404, json=problem_of(UnknownJob(), "7"))
    end = httpx2.Response(200, json={"state": "done"})
    assert waiting([going, *away, going, *away, end], 60.0) == {"state": "done"}
    for answers, patience in (([*away, end], 60.0), ([going, *away, end], 0.0)):
        with pytest.raises(joulepath.ServiceUnreachable, match="refused"):
            waiting(answers, patience)
    with pytest.raises(joulepath.ServiceError, match="job"):
        waiting([going, gone, end], 60.0)


def waiting(answers: Sequence[httpx2.Response | Exception], patience: float) -> Any:
    left = iter(answers)

    def answer(_: httpx2.Request) -> httpx2.Response:
        found = next(left)
        if isinstance(found, Exception):
            raise found
        return httpx2.Response(found.status_code, content=found.content)

    http = httpx2.Client(transport=httpx2.MockTransport(answer))
    return joulepath.Client("http://service", http=http).wait_for_job("7", 0.0, patience=patience)


def answering(status: int, content: bytes, **headers: str) -> joulepath.Client:
    transport = httpx2.MockTransport(
        lambda _: httpx2.Response(status, content=content, headers=headers)
    )
    return joulepath.Client("http://other", http=httpx2.Client(transport=transport))


@pytest.mark.parametrize("content", [b"<html>Bad Gateway</html>", b"[]", b'{"type": null}'])
def test_another_server_is_no_service(content: bytes) -> None:
    with pytest.raises(joulepath.ServiceUnreachable, match="http://other: it answers 502"):
        answering(502, content).optimize(move())


@pytest.mark.parametrize("content", [b"<html>Log in</html>", b"[]", b""])
def test_another_server_that_answers_is_no_service(content: bytes) -> None:
    """A proxy's page is refused, and so is a redirection: the key is not sent along."""
    other = answering(200, content)
    with pytest.raises(joulepath.ServiceUnreachable, match="another program"):
        other.optimize(move())
    with pytest.raises(joulepath.ServiceUnreachable, match="refers to https://other"):
        answering(301, content, location="https://other").mjcf("ur5e")


def test_arrays_of_any_layout_are_sent(service: joulepath.Client) -> None:
    rows = np.array([HOME, HOME, NEAR, NEAR])
    for each in (rows[::3], np.asfortranarray(rows[::3])):
        found = service.evaluate(configurations=each, time_per_segment=np.float32(1.5))
        assert found["duration"] == pytest.approx(1.5)


@pytest.mark.parametrize("value", [float("nan"), np.array(np.inf), {1}, object(), 2**70])
def test_what_json_has_not_is_refused(service: joulepath.Client, value: object) -> None:
    """NaN is not sent as null, because null would leave the field out."""
    with pytest.raises(joulepath.InvalidRequest) as caught:
        service.optimize(move(), duration=value)
    assert caught.value.errors[0]["loc"] in (["body", "duration"], ["body"])


def test_a_name_leads_to_no_other_path(service: joulepath.Client) -> None:
    for name in ("../jobs", "..", ".", "ur5e/urdf", "ur5e?", "ur5e#", ""):
        with pytest.raises((joulepath.ServiceError, joulepath.UnknownRobot)):
            service.load_robot(name)
    assert service.get("robots")["robots"]


def test_nobody_answers() -> None:
    for url in ("ftp://a", "127.0.0.1:1", "http://a:b"):
        with pytest.raises(joulepath.ServiceUnreachable, match=url):
            joulepath.Client(url).optimize(move())
    with (
        joulepath.Client("http://127.0.0.1:1") as client,
        pytest.raises(joulepath.ServiceUnreachable, match=r"http://127\.0\.0\.1:1"),
    ):
        client.optimize(move())


def test_the_key_goes_along() -> None:
    seen = list[str | None]()

    def answer(request: httpx2.Request) -> httpx2.Response:
        seen.append(request.headers.get("authorization"))
        return httpx2.Response(200, json={"jobs": [], "next": None})

    http = httpx2.Client(transport=httpx2.MockTransport(answer))
    for key in ("secret", "secret\n", None, ""):
        assert [*joulepath.Client("http://service/", key, http=http).jobs()] == []
    assert seen == ["Bearer secret", "Bearer secret", None, None]


@pytest.mark.parametrize("key", ["sec\nret", "sécret"])
def test_an_error_does_not_repeat_the_key(key: str) -> None:
    with pytest.raises(joulepath.ServiceError, match="not valid") as caught:
        joulepath.Client("http://service", key)
    assert caught.value.slug() == "unauthenticated" and key not in str(caught.value)


def test_all_pages_of_jobs() -> None:
    pages = {None: ([{"id": "a"}], "a"), "a": ([{"id": "b"}], None)}

    def page(request: httpx2.Request) -> httpx2.Response:
        jobs, following = pages[request.url.params.get("after")]
        return httpx2.Response(200, json={"jobs": jobs, "next": following})

    http = httpx2.Client(transport=httpx2.MockTransport(page))
    found = joulepath.Client("http://service", http=http).jobs()
    assert [each["id"] for each in found] == ["a", "b"]


def test_without_httpx_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "httpx2", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'joulepath\[client\]'"):
        joulepath.Client("http://service")
