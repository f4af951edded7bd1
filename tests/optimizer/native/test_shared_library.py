"""The C library shared by all arms: compilation, loading, and the computed frames."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.native import build, shared_library
from joulepath.optimizer.native.build import FOLDER, LIBRARY, BuildFailed, sources_digest
from joulepath.optimizer.native.shared_library import LibraryUnusable, load
from joulepath.optimizer.problem.robots import load_robot
from tests.selection import ROBOTS

pytestmark = pytest.mark.usefixtures("compiler")
FRAMES = 1e-14  # m and cosines; both round, and numpy's sine differs in the last digit


def test_one_that_is_missing_is_told_with_its_remedy(tmp_path: Path) -> None:
    with pytest.raises(LibraryUnusable, match=r"is missing\. `make ready` compiles it") as told:
        load(tmp_path / "none.so")
    assert isinstance(told.value, ImportError) and told.value.path == str(tmp_path / "none.so")


def test_a_file_that_is_another_is_told(tmp_path: Path) -> None:
    text, another = tmp_path / "text.so", tmp_path / "another.so"
    text.write_text("no library", encoding="utf-8")
    with pytest.raises(LibraryUnusable, match=r"cannot be loaded: .*text\.so"):
        load(text)
    code = tmp_path / "another.c"
    code.write_text("double other(double x) { return x; }", encoding="utf-8")
    compile_c(code, another)
    with pytest.raises(LibraryUnusable, match=r"cannot be loaded: .*sources_digest"):
        load(another)


def compile_c(code: Path, target: Path) -> None:
    compiler = build.compiler()
    assert compiler is not None, "make installs a compiler where there is none"
    subprocess.run([compiler, "-shared", "-fPIC", code, "-o", target], check=True)


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    """A folder with the C files."""
    folder = tmp_path / "native"
    folder.mkdir()
    for path in FOLDER.glob("*.c"):
        shutil.copy(path, folder)
    return folder


def test_one_of_other_sources_is_never_called(
    sources: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a change of any C file, a structure may have another layout."""
    with (sources / "vectors.c").open("a", encoding="utf-8") as file:
        file.write("/* changed */\n")
    changed = sources_digest(sources)
    monkeypatch.setattr(shared_library, "sources_digest", lambda: changed)
    with pytest.raises(LibraryUnusable, match="was compiled from other sources"):
        load(LIBRARY)


@pytest.mark.long
def test_a_clone_that_was_not_set_up_cannot_be_imported(tmp_path: Path) -> None:
    """The error is the library's own, and its remedy helps."""
    library = build.__name__.removesuffix(".native.build")
    for package in {library.partition(".")[0], load_robot.__module__.partition(".")[0]}:
        spec = find_spec(package)
        assert spec is not None and spec.submodule_search_locations
        ignored = shutil.ignore_patterns(build.LIBRARY.name, "__pycache__")
        shutil.copytree(spec.submodule_search_locations[0], tmp_path / package, ignore=ignored)

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *command], cwd=tmp_path, capture_output=True, text=True, timeout=300
        )

    refused = run("-c", f"import {link_frames.__module__}")
    assert refused.returncode == 1
    said = refused.stderr.splitlines()[-1]
    assert said.startswith(
        f"{LibraryUnusable.__module__}.LibraryUnusable: The C library {tmp_path}"
    )
    found = re.search("`python (.*build[.]py)`", said)
    assert found is not None
    assert run(found[1]).returncode == 0
    assert run("-c", f"import {link_frames.__module__}").returncode == 0


def test_it_is_compiled_for_every_processor_of_its_kind(tmp_path: Path) -> None:
    """No result depends on the processor: the library compiled for this processor gives bitwise
    equal frames.
    """
    compiler = build.compiler()
    assert compiler is not None
    own = tmp_path / "own.so"
    define = f'-DSOURCES_DIGEST="{sources_digest()}"'
    flags = [*build.FLAGS, "-march=native", define]
    subprocess.run([compiler, *flags, FOLDER / "library.c", "-o", own, "-lm"], check=True)
    robot = load_robot("ur5e")
    placements = joint_placements(robot.model)
    q = np.random.default_rng(1).uniform(-7, 7, (500, robot.nq))
    frames = np.empty((500, robot.nq + 1, 4, 4))
    load(own).link_frames(500, robot.nq, placements.ctypes.data, q.ctypes.data, frames.ctypes.data)
    assert frames.tobytes() == link_frames(placements, q).tobytes()


def test_a_compiler_that_fails_is_told_with_its_remedy(
    tmp_path: Path, sources: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The earlier library stays."""
    (sources / LIBRARY.name).write_bytes(b"before")
    there = set(sources.iterdir())
    monkeypatch.setattr(build, "find_spec", lambda _: None)
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho no such option >&2\nexit 1\n", encoding="utf-8")
    broken.chmod(0o755)
    monkeypatch.setenv("CC", str(broken))
    with pytest.raises(BuildFailed, match=r"(?s)no such option.*Set CC to a C compiler that works"):
        build.build(sources)
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("PATH", os.devnull)
    with pytest.raises(BuildFailed, match="neither a C compiler nor the package ziglang"):
        build.build(sources)
    assert (sources / LIBRARY.name).read_bytes() == b"before" and set(sources.iterdir()) == there


def frames_by_numpy(placements: Array, q: Array) -> Array:
    """T_base_link (n, nq + 1, 4, 4)."""
    c, s = np.cos(q)[..., None], np.sin(q)[..., None]
    x, y = placements[..., 0], placements[..., 1]
    frames = np.empty((len(q), q.shape[1] + 1, 4, 4))
    frames[:, 0] = np.eye(4)
    # placements of all joints, turned about their z axes
    steps = np.empty((*q.shape, 4, 4))
    steps[..., 0], steps[..., 1] = c * x + s * y, c * y - s * x
    steps[..., 2:] = placements[..., 2:]
    for j in range(q.shape[1]):
        np.matmul(frames[:, j], steps[:, j], out=frames[:, j + 1])
    return frames


@pytest.mark.parametrize("name", ROBOTS)
def test_frames_are_those_of_numpy(name: str) -> None:
    """Also for zero configurations, for some joints alone, and for non-contiguous arrays."""
    robot = load_robot(name)
    placements = joint_placements(robot.model)
    q = np.random.default_rng(4).uniform(-7, 7, (robot.nq, 200)).T
    assert not q.flags.c_contiguous
    for given, of in (
        (q, placements),
        (q[:0], placements),
        (q[:, :3], placements[:3]),
        (q[::7], placements),
    ):
        np.testing.assert_allclose(
            link_frames(of, given), frames_by_numpy(of, given), rtol=0, atol=FRAMES
        )
