"""Uploads made to hold or to end a worker."""

from __future__ import annotations

import base64
import gzip
import io
import json
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import DeadlineExceeded, InvalidArm, InvalidProblem, InvalidRequest, load_robot
from joulepath.app.api.evaluate.task import EvaluateTask
from joulepath.app.api.identifications.request import IdentifyRequest
from joulepath.app.api.identifications.task import IdentifyTask
from joulepath.app.api.ik.task import IKRequest, IKTask
from joulepath.app.api.logs.request import LogSettings
from joulepath.app.api.logs.task import ReadLogTask
from joulepath.app.api.robots.request import OwnArm
from joulepath.app.api.robots.task import OwnRobotTask
from joulepath.app.convert.mesh_file import mesh_from_file
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.convert.request import to_problem
from joulepath.app.exceptions.transport import BodyTooLarge
from joulepath.app.schemas.examples.own_arm import ARM, URDF
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.uploads.limits import LIMITS
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from tests.app.routes.test_problems import refused
from tests.identification_logs import csv_of, recorded, truth_of
from tests.models.own_arm.arms import BLOCK, PLAIN, SHAPE, changed, meshed, obj
from tests.optimizer.clocks import CountingClock
from tests.refusals import refusal_of

CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
LATE = 20.0
"""Deadline [s] by a clock that moves by 1 s whenever it is read: it passes while a file of some
pieces is read.
"""
MORE_READINGS = 12
"""Readings of the clock after the deadline: one that ends the reading, and those of whoever asks
for the time left.
"""
# a document or file of a given size, and its expected fate
DOCUMENTS: dict[str, tuple[Callable[[int], str], str]] = {
    "open comments": (lambda n: "<robot>" + "<!--" * n, "not XML"),
    "comments": (
        lambda n: URDF.replace("</robot>", "<!---->" * n + "</robot>"),
        "more than 200000 elements",
    ),
    "attributes": (
        lambda n: URDF.replace("<robot", "<robot " + " ".join(f'a{k}=""' for k in range(n)), 1),
        "more than 200 attributes",
    ),
    "levels": (
        lambda n: URDF.replace("</robot>", "<a>" * n + "</a>" * n + "</robot>"),
        "more than 100 levels",
    ),
    "unclosed levels": (lambda n: URDF.replace("</robot>", "<a>" * n), "more than 100 levels"),
    "elements": (lambda n: URDF.replace("</robot>", "<a/>" * n + "</robot>"), "more than"),
    "instructions": (
        lambda n: URDF.replace("</robot>", "<?a?>" * n + "</robot>"),
        "more than 200000 elements",
    ),
    "entities": (
        lambda n: "<!DOCTYPE r [<!ENTITY a '" + "a" * n + "'>]><robot>" + "&a;" * n + "</robot>",
        "document type",
    ),
    "shapes": (
        lambda n: URDF.replace(
            SHAPE, SHAPE + "</geometry></collision><collision><geometry>" + SHAPE, 1
        ).replace(
            '<link name="tool"/>',
            '<link name="tool">' + f"<collision><geometry>{SHAPE}</geometry>"
            "</collision>" * min(n, 2000) + "</link>",
        ),
        "more than 1000 shapes",
    ),
    "words": (lambda n: URDF.replace('"0 0 0.2"', '"' + "0 " * n + '"', 1), "not 3 finite numbers"),
    "names": (lambda n: URDF.replace('link="upper_arm"', f'link="{"a" * n}"'), "no <child> link"),
    "spaces": (
        lambda n: URDF.replace("<robot", "<robot" + " " * LIMITS.xml_bytes),
        "more than 8 MiB",
    ),
    "zeros": (lambda n: "\0" * n, "not XML"),
    "surrogates": (lambda n: "<robot>" + "\ud800" * n, "not XML"),
}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_urdf_that_holds_too_much_is_refused_at_once(name: str) -> None:
    """Such a file of the size of a request's body once took seconds to minutes, or the worker."""
    make, words = DOCUMENTS[name]
    with pytest.raises(InvalidArm, match=words) as found:
        own_figures("mine", changed(urdf=make(210_000)))
    assert found.value.field == "urdf" and len(str(found.value)) < 500


def test_what_is_below_the_limits_is_read() -> None:
    many = " ".join(f'a{k}=""' for k in range(LIMITS.xml_attributes - 1))
    deep = LIMITS.xml_depth - 1
    text = URDF.replace("<robot", f"<robot {many}", 1)
    text = text.replace("</robot>", "<a>" * deep + "</a>" * deep + "<!---->" * 1000 + "</robot>")
    assert_read_alike(text)


@pytest.mark.parametrize(
    "made",
    [
        lambda text: "\ufeff" + text,
        lambda text: '<?xml version="1.0" encoding="UTF-16"?>' + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("</robot>", '<!-- <xacro:a b="${c}"/> <!DOCTYPE d> --></robot>'),
        lambda text: text.replace(
            "<robot", '<robot xmlns="http://www.ros.org" xmlns:xacro="http://ros.org/xacro"', 1
        ),
        lambda text: text.replace("</robot>", '<gz:plugin gz:a="1"><b/></gz:plugin></robot>'),
        lambda text: text.replace("</robot>", "<gazebo><![CDATA[ a < b ]]></gazebo></robot>"),
        lambda text: text.replace(
            "</robot>", '<gazebo a="&lt;&#65;">&amp;&gt;</gazebo><?php a?></robot>'
        ),
    ],
)
def test_what_public_urdfs_contain_is_no_fault(made: Callable[[str], str]) -> None:
    assert_read_alike(made(URDF))


def assert_read_alike(urdf: str) -> None:
    """A URDF gives the figures of the plain one; remarks name only elements without effect."""
    document, remarks = own_figures("mine", changed(urdf=urdf))
    plain, others = own_figures("mine", PLAIN)
    assert document == plain
    assert [each for each in remarks if "without effect" not in each] == others


def glb(document: dict[str, Any], data: bytes) -> bytes:
    head = json.dumps(document).encode()
    parts = [
        (0x4E4F534A, head + b" " * (-len(head) % 4)),
        (0x004E4942, data + b"\0" * (-len(data) % 4)),
    ]
    content = b"".join(struct.pack("<II", len(part), kind) + part for kind, part in parts)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(content)) + content


def one_triangle(primitives: int, nodes: list[dict[str, Any]]) -> bytes:
    data = np.eye(3, dtype="<f4").tobytes() + np.arange(3, dtype="<u4").tobytes()
    return glb(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": 48}],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 12},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
            ],
            "meshes": [
                {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * primitives}
            ],
            "nodes": nodes,
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        },
        data,
    )


def mesh(kind: Any, content: bytes) -> Any:
    return mesh_from_file(kind, base64.b64encode(content).decode(), 1.0)


def groups() -> bytes:
    faces = (b"g a%d\nusemtl m%d\nf 1 2 3\n" % (k, k) for k in range(40_000))
    return CORNERS + b"".join(faces)


def solids() -> bytes:
    return b"solid\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendsolid\n" * 40_000


@pytest.mark.parametrize(("kind", "content"), [("obj", groups), ("stl", solids)])
def test_groups_materials_and_solids_cost_nothing(kind: Any, content: Callable[[], bytes]) -> None:
    """The mesh has the triangles of all groups.

    The time once grew as the square of their number, to minutes for these files.
    """
    assert len(mesh(kind, content()).corners) == 40_000


@pytest.mark.parametrize(
    ("primitives", "nodes"),
    [
        (1, [{"mesh": 0, "children": [k + 1]} for k in range(999)] + [{"mesh": 0}]),
        (1, [{"mesh": 0, "children": [1]}, {"mesh": 0, "children": [0]}]),
        (40_000, [{"mesh": 0}]),
        (200, [{"mesh": 0}] * 200),
    ],
)
def test_a_glb_of_many_copies_is_refused(primitives: int, nodes: list[dict[str, Any]]) -> None:
    with pytest.raises(InvalidProblem, match="not a plain glb file"):
        mesh("glb", one_triangle(primitives, nodes))


def test_corners_that_count_back_are_those_above_the_face() -> None:
    """A negative index counts back from its face.

    Counted from the end of the file, both faces would have the corners of the second triangle.
    """
    content = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3/1/1 -2//2 -1\n"
    )
    heights = mesh("obj", content).corners[:, :, 2]
    assert sorted(heights.max(axis=1)) == [0.0, 5.0] and sorted(heights.min(axis=1)) == [0.0, 5.0]


@pytest.mark.parametrize(
    "content",
    [
        CORNERS + b"f 0 1 2\n",
        CORNERS + b"f 1 2 4\n",
        CORNERS + b"f -4 2 3\n",
        CORNERS + b"f 1 2 3" + b"9" * 100_000,
        CORNERS + b"f" + b" 1 2 3" * 300_000,
        CORNERS + b"f 1 2 3\n" * 100_001,
        CORNERS.replace(b"v 1 0 0", b"v 1 0"),
        CORNERS.replace(b"v 1 0 0", b"v 1 0 nan") + b"f 1 2 3\n",
        CORNERS.decode().encode("utf-16"),
        b"\0" * 1000,
        b"",
    ],
)
def test_an_obj_that_is_none_or_too_large_is_refused(content: bytes) -> None:
    with refusal_of("data"):
        mesh("obj", content)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> CountingClock:
    """The clock of all deadlines, moving at every reading."""
    clock = CountingClock()
    monkeypatch.setattr(
        Deadline, "after", lambda seconds, _=None: Deadline(clock() + seconds, clock)
    )
    return clock


def zipped(files: dict[str, bytes]) -> str:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return base64.b64encode(target.getvalue()).decode()


@pytest.fixture(scope="module")
def log_file() -> bytes:
    robot = load_robot("ur5e")
    return csv_of(recorded(robot, truth_of(robot), moves=2))


def late_tasks(log: bytes, folder: Path) -> Iterator[tuple[str, Any]]:
    """Tasks of all endpoints with an upload."""
    path = folder / "upload.csv"
    path.write_bytes(log)
    many = CORNERS + b"v 0 0 1\n" + b"f 1 2 3\nf 2 3 4\n" * (30 * LIMITS.mesh_lines)
    remarks = base64.b64encode(b"#\n" * (30 * LIMITS.mesh_lines) + obj(np.eye(4, 3))).decode()
    scene = {"obstacles": [{"name": "bin", "shape": "mesh_file", "format": "obj", "data": remarks}]}
    with_mesh = OwnArm.model_validate(
        {**ARM, "urdf": meshed(""), "meshes": zipped({"link.obj": many})}
    )
    yield "a mesh of a robot", OwnRobotTask("mine", with_mesh, "id")
    text = OwnArm.model_validate(
        {**ARM, "urdf": URDF.replace("</robot>", " " * (30 * LIMITS.xml_piece) + "</robot>")}
    )
    yield "a URDF", OwnRobotTask("mine", text, "id")
    yield "a log", ReadLogTask(str(path), LogSettings(robot="ur5e"), 1 << 30, "id")
    motion = folder / "motion.csv"
    motion.write_text("q1,q2,q3,q4,q5,q6\n" + "0,0,0,0,0,0\n" * 200)
    yield (
        "a motion",
        EvaluateTask(str(motion), "csv", {"time_per_segment": "1"}, "json", "id", LATE),
    )
    request = IdentifyRequest.model_validate(
        {"logs": ["1" * 8 + "-" + "-".join(["1" * 4] * 3) + "-" + "1" * 12]}
    )
    settings = LogSettings(robot="ur5e").model_dump(mode="json")
    yield (
        "an identification",
        IdentifyTask(request, (GivenLog("log", settings, gzip.compress(log)),), "id"),
    )
    pose = {"position": [0.4, 0.1, 0.3], "rpy": [0, 0, 0]}
    yield "a scene of /ik", IKTask(IKRequest.model_validate({"pose": pose, "scene": scene}), "id")
    move = {"start": {"q": [0.0] * 6}, "goal": {"q": [1.0] * 6}, "scene": scene}
    asked = OptimizeRequest.model_validate(move)
    yield (
        "a scene",
        type("Task", (), {"run": staticmethod(lambda deadline: to_problem(asked, deadline))}),
    )


def test_what_is_read_ends_at_its_deadline(
    clock: CountingClock, log_file: bytes, tmp_path: Path
) -> None:
    """Reading stops at once with the typed error, whichever task it is part of."""
    for name, task in late_tasks(log_file, tmp_path):
        began = clock.now
        with pytest.raises(DeadlineExceeded):
            task.run(LATE)
        assert clock.now - began < LATE + MORE_READINGS, name


@pytest.mark.parametrize(
    "content", [gzip.compress(b"") * 10_000, gzip.compress(b"t,q1\n" + b"#\n" * 100_000)]
)
def test_gzip_that_yields_nothing_ends_at_the_deadline(content: bytes) -> None:
    from joulepath.optimizer.identify.logs.reading import read_log

    with pytest.raises(DeadlinePassed), watch(Deadline(LATE, CountingClock())):
        read_log(content, load_robot("ur5e"))


@pytest.mark.parametrize(
    "change",
    [
        lambda: {"urdf": "<robot>" + "<!--" * 500_000},
        lambda: {"urdf": DOCUMENTS["attributes"][0](100_000)},
        lambda: {"urdf": DOCUMENTS["levels"][0](400_000)},
        lambda: {"urdf": URDF.replace(SHAPE, '<cylinder radius="-0.2" length="0.3"/>')},
        lambda: {
            "urdf": meshed('scale="1e-9 1e-9 1e-9"'),
            "meshes": zipped({"link.obj": obj(BLOCK)}),
        },
        lambda: {"urdf": meshed(""), "meshes": zipped({"link.obj": groups()})},
        lambda: {"meshes": zipped({"a.stl": b"\0" * (LIMITS.mesh_bytes + 1)})},
    ],
)
def test_the_worker_answers_and_lives_on(
    client: TestClient, change: Callable[[], dict[str, Any]]
) -> None:
    """The last mesh but one has three corners only, in 40,000 groups."""
    workers = sorted(client.app.state.engine.worker_pids)  # type: ignore[attr-defined]
    errors = refused(
        client.post("/robots", json={"name": "attack", **ARM, **change()}), InvalidRequest
    )["errors"]
    assert errors[0]["loc"] in (["body", "urdf"], ["body", "meshes"])
    assert sorted(client.app.state.engine.worker_pids) == workers  # type: ignore[attr-defined]


def test_a_body_that_unpacks_to_more_than_the_limit_is_refused(client: TestClient) -> None:
    """70 kB of gzip make 70 MB of JSON, which is refused packed or not."""
    content = b'{"urdf": "' + b" " * 70_000_000 + b'"}'
    headers = {"Content-Type": "application/json"}
    packed = client.post(
        "/robots", content=gzip.compress(content), headers={**headers, "Content-Encoding": "gzip"}
    )
    refused(packed, BodyTooLarge)
    refused(client.post("/robots", content=content, headers=headers), BodyTooLarge)
