"""Identified figures of an arm: stored, used by every endpoint, moved, deleted, and refused."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from starlette.testclient import TestClient

from joulepath import InvalidFigures, InvalidRequest, load_robot, optimize
from joulepath.app.api.figures.models import FiguresDetail, FiguresList
from joulepath.app.exceptions.stored import FiguresInUse, TooManyFigures, UnknownFigures
from joulepath.app.schemas.examples.figures import FIGURES
from tests.app.recorded import recorded_service
from tests.app.requests import HOME, NEAR, move
from tests.app.routes.test_problems import refused
from tests.optimizer.moves import problem

NOWHERE = "00000000-0000-0000-0000-000000000000"


@pytest.fixture
def stored(client: TestClient) -> Iterator[str]:
    """Id of stored figures."""
    answer = client.put("/figures", json=FIGURES)
    assert answer.status_code == 201, answer.text
    yield answer.json()["id"]
    client.delete(f"/figures/{answer.json()['id']}")


def changed(*path: Any, to: Any) -> dict[str, Any]:
    """The example with another value at a path."""
    document = copy.deepcopy(FIGURES)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return document


def test_figures_are_stored_shown_and_deleted(client: TestClient) -> None:
    answer = client.put("/figures", json=FIGURES)
    made = FiguresDetail.model_validate_json(answer.content)
    assert (
        answer.headers["location"] == f"/figures/{made.id}"
        and made.robot == "ur5e"
        and made.parameters == 2
    )
    assert list(made.friction_laws) == ["identified", "curved", "coulomb_viscous"]
    assert made.kinematics == load_robot("ur5e").figures["kinematics"]
    shown = client.get(f"/figures/{made.id}")
    assert shown.json() == answer.json()
    # Shown figures can be stored again, here and elsewhere, under the same id.
    again = client.put("/figures", json=shown.json())
    assert (again.status_code, again.json()) == (200, shown.json())
    listed = FiguresList.model_validate_json(client.get("/figures").content).figures
    assert [(each.id, each.parameters) for each in listed if each.id == made.id] == [(made.id, 2)]
    assert client.delete(f"/figures/{made.id}").status_code == 204
    for method in (client.get, client.delete):
        refused(method(f"/figures/{made.id}"), UnknownFigures)
    refused(client.get("/figures/none"), UnknownFigures)


def test_a_file_for_the_library(client: TestClient, stored: str, tmp_path: Path) -> None:
    """The library computes the same from the file as the service from the stored figures."""
    answer = client.get(f"/figures/{stored}", headers={"accept": "application/yaml"})
    assert answer.headers["content-type"].startswith("application/yaml")
    file = tmp_path / "my_ur5e.yaml"
    file.write_text(answer.text, encoding="utf-8")
    robot = load_robot("ur5e", figures=file)
    assert robot is load_robot("ur5e", figures=yaml.safe_load(answer.text))
    assert robot.friction.name == "identified" and robot.friction.load is not None
    ours = optimize(problem(HOME, NEAR, robot=robot)).energy.electrical
    theirs = client.post("/optimize", json=move(figures=stored, collisions=False)).json()["energy"][
        "electrical"
    ]
    assert ours.total == pytest.approx(theirs["total"], rel=1e-5)
    assert ours.interval is not None and ours.interval.sd == pytest.approx(
        theirs["interval"]["sd"], rel=1e-4
    )
    assert {"coulomb", "load", "session", "move"} <= set(theirs["interval"]["shares"])


def test_every_request_about_a_motion_takes_them(client: TestClient, stored: str) -> None:
    own, used = (
        client.post("/optimize", json=move(**given)).json() for given in ({}, {"figures": stored})
    )
    assert own["energy"]["electrical"]["friction"] != used["energy"]["electrical"]["friction"]
    assert own["energy"]["electrical"]["interval"] != used["energy"]["electrical"]["interval"]
    # The robot's own figures have not changed.
    again = client.post("/optimize", json=move()).json()
    assert again["energy"]["electrical"]["total"] == own["energy"]["electrical"]["total"]
    motion = {"configurations": [HOME, NEAR], "time_per_segment": 1.5}
    energies = [
        client.post("/evaluate", json=motion | given).json()["total"]["energy"]["electrical"][
            "friction"
        ]
        for given in ({}, {"figures": stored})
    ]
    assert energies[0] != energies[1]
    table = "q1,q2,q3,q4,q5,q6\n" + "\n".join(",".join(map(str, q)) for q in (HOME, NEAR)) + "\n"
    query = {"time_per_segment": "1.5", "figures": stored}
    by_csv = client.post(
        "/evaluate", content=table, params=query, headers={"content-type": "text/csv"}
    ).json()
    assert by_csv["total"]["energy"]["electrical"]["friction"] == pytest.approx(
        energies[1], rel=1e-9
    )
    changes = [{"name": "lighter", "arm": {"link_mass_scale": 0.5}}]
    base = client.post(
        "/whatif", json={"evaluate": motion | {"figures": stored}, "changes": changes}
    ).json()["base"]
    assert base["electrical"]["friction"] == pytest.approx(energies[1], rel=1e-9)
    # The answer names its figures, so other endpoints can compute with it.
    assert used["arm"]["figures"] == stored
    assert client.post("/export/csv", json={"answer": used["answer"]}).status_code == 200
    job = client.post("/jobs", json={"requests": [{"optimize": move(figures=stored)}]})
    assert job.status_code in (201, 202), job.text


@pytest.mark.long
def test_a_study_keeps_its_figures(client: TestClient, stored: str) -> None:
    study = client.post(
        "/studies", json={"name": "With figures", "threshold": 1.0, "figures": stored}
    ).json()
    assert study["figures"] == stored
    path = f"/studies/{study['id']}"
    step = client.post(f"{path}/iterations", json={"optimize": move()})
    assert step.status_code == 201, step.text
    assert step.json()["request"]["optimize"]["figures"] == stored
    wanted = client.post("/optimize", json=move(figures=stored)).json()["energy"]["electrical"][
        "total"
    ]
    assert step.json()["energy"] == pytest.approx(wanted)
    refused(client.delete(f"/figures/{stored}"), FiguresInUse)
    other = refused(
        client.post(f"{path}/iterations", json={"optimize": move(figures=NOWHERE)}), InvalidRequest
    )
    assert other["errors"][0]["loc"][-2:] == ["optimize", "figures"]
    assert client.get(f"{path}/suggest", params={"deadline": 5.0}).status_code == 200
    assert client.delete(path).status_code == 204
    assert client.delete(f"/figures/{stored}").status_code == 204


def test_figures_that_are_not_there(client: TestClient, stored: str) -> None:
    refused(client.post("/optimize", json=move(figures=NOWHERE)), UnknownFigures)
    refused(
        client.post("/studies", json={"name": "x", "threshold": 1.0, "figures": NOWHERE}),
        UnknownFigures,
    )
    motion = {"configurations": [HOME, NEAR], "time_per_segment": 1.5}
    refused(client.post("/evaluate", json=motion | {"figures": NOWHERE}), UnknownFigures)
    refused(client.post("/optimize", json=move(figures="ur5e")), InvalidRequest)
    # of another robot
    (error,) = refused(
        client.post("/optimize", json=move(robot="ur10e", figures=stored)), InvalidRequest
    )["errors"]
    assert error["loc"] == ["body", "figures"] and "ur5e" in error["msg"]
    change = [{"name": "x", "arm": {"figures": stored}}]
    refused(client.post("/whatif", json={"optimize": move(), "changes": change}), InvalidRequest)


NO_BODY = {"value": [[1.0, 0, 0, 1.0, 0, 9.0]] * 6, "unit": "1", "source": "x", "trust": "B"}
FRICTION = ("friction_laws", "identified")
BAD: dict[str, tuple[dict[str, Any], list[str]]] = {
    "negative": (
        changed(*FRICTION, "coulomb", "value", to=[-1.0] * 6),
        ["friction_laws", "identified", "coulomb"],
    ),
    "too few": (
        changed(*FRICTION, "viscous", "value", to=[1.0] * 5),
        ["friction_laws", "identified", "viscous"],
    ),
    "a share of 1": (
        changed(*FRICTION, "load", "value", to=[1.0] * 6),
        ["friction_laws", "identified", "load"],
    ),
    "words": (
        changed(*FRICTION, "coulomb", "value", to=["a"] * 6),
        ["friction_laws", "identified", "coulomb"],
    ),
    "huge": (
        changed(*FRICTION, "coulomb", "value", to=[1e300] * 6),
        ["friction_laws", "identified", "coulomb"],
    ),
    "no source": (
        changed(*FRICTION, "coulomb", to={"value": [1.0] * 6}),
        ["friction_laws", "identified", "coulomb"],
    ),
    "no law": (changed("friction_laws", to={}), ["friction_laws"]),
    "another chain": (FIGURES | {"kinematics": {"dh_a": {"value": [1.0] * 6}}}, ["kinematics"]),
    "other limits": (FIGURES | {"limits": {}}, ["limits"]),
    "an unknown figure": (
        changed("drives", "gear_ratio", to={"value": [1.0] * 6}),
        ["drives", "gear_ratio"],
    ),
    "no such name": (
        changed("covariance", "names", 0, to="drives.copper.9"),
        ["covariance", "names"],
    ),
    "of another law": (
        changed("covariance", "names", 0, to="friction_laws.none.load.0"),
        ["covariance", "names"],
    ),
    "twice": (
        changed("covariance", "names", 0, to=FIGURES["covariance"]["names"][1]),
        ["covariance", "names"],
    ),
    "not symmetric": (
        changed("covariance", "matrix", to=[[1.0, 0.5], [0.0, 1.0]]),
        ["covariance", "matrix"],
    ),
    "indefinite": (
        changed("covariance", "matrix", to=[[1.0, 2.0], [2.0, 1.0]]),
        ["covariance", "matrix"],
    ),
    "endless": (
        changed("covariance", "matrix", to=[[1e308, 0.0], [0.0, 1.0]]),
        ["covariance", "matrix"],
    ),
    "ragged": (changed("covariance", "matrix", to=[[1.0], [2.0, 1.0]]), ["covariance", "matrix"]),
    "no body": (FIGURES | {"inertials": {"inertia": NO_BODY}}, ["inertials", "inertia"]),
    "an unknown field": (FIGURES | {"frictions": {}}, []),
    "absurd": (FIGURES | {"move_sd": -1.0}, ["move_sd"]),
}


@pytest.mark.parametrize("name", BAD)
def test_what_makes_no_figures(client: TestClient, name: str) -> None:
    """The service names the place, and the library refuses the same."""
    document, place = BAD[name]
    error = refused(client.put("/figures", json=document), InvalidRequest)["errors"][0]
    assert error["loc"][1 : 1 + len(place)] == place, error
    if place and "unknown" not in name and name not in ("absurd", "ragged"):
        with pytest.raises(InvalidFigures) as raised:
            load_robot("ur5e", figures=document)
        assert raised.value.field.split(".")[: len(place)] == place
    assert document["robot"] == "ur5e" and json.dumps(document)


@pytest.mark.parametrize("section", ["friction_laws", "drives", None])
def test_a_document_with_the_robots_own_figures_alone_is_refused(
    client: TestClient, section: str | None
) -> None:
    own = load_robot("ur5e").figures
    document = {"robot": "ur5e"} | ({} if section is None else {section: own[section]})
    error = refused(client.put("/figures", json=document), InvalidRequest)["errors"][0]
    assert "No figure differs" in error["msg"] and "friction_laws" in error["msg"]


def test_a_document_names_its_robot() -> None:
    with pytest.raises(InvalidFigures, match="another robot than ur10e"):
        load_robot("ur10e", figures=FIGURES)


def test_no_more_than_the_service_holds() -> None:
    with recorded_service(max_figures=0) as client:
        refused(client.put("/figures", json=FIGURES), TooManyFigures)


def test_refitted_inertials_have_a_kernel_of_their_own(client: TestClient) -> None:
    """Links made heavier by figures equal links made heavier by the request."""
    masses = load_robot("ur5e").figures["inertials"]
    heavier = {
        "mass": masses["mass"] | {"value": [1.5 * m for m in masses["mass"]["value"]]},
        "inertia": masses["inertia"]
        | {"value": [[1.5 * x for x in row] for row in masses["inertia"]["value"]]},
    }
    stored = client.put("/figures", json={"robot": "ur5e", "inertials": heavier}).json()["id"]
    motion = {"configurations": [HOME, NEAR], "time_per_segment": 1.5}
    by_figures = client.post("/evaluate", json=motion | {"figures": stored}).json()["total"][
        "energy"
    ]["electrical"]
    by_request = client.post("/evaluate", json=motion | {"link_mass_scale": 1.5}).json()["total"][
        "energy"
    ]["electrical"]
    assert by_figures["total"] == pytest.approx(by_request["total"], rel=1e-9)
    client.delete(f"/figures/{stored}")
