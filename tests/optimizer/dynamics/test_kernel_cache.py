"""The life of a compiled kernel: name, seal, compilation, and waiting of concurrent processes.

Tests compile without optimisation, by a compiler that adds a flag and logs its calls.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType

import numpy as np
import pinocchio as pin
import pytest

import joulepath
from joulepath import Robot, optimize, robot_names
from joulepath.optimizer.dynamics import kernel
from joulepath.optimizer.dynamics.kernel import Kernel, kernel_for
from joulepath.optimizer.dynamics.kernel_cache import (
    SOURCE_MODULES,
    compile_kernel,
    digest,
    library_path,
    library_paths,
)
from joulepath.optimizer.dynamics.kernel_expressions import build
from joulepath.optimizer.dynamics.kernel_source import AVX2, PORTABLE, source
from joulepath.optimizer.native.build import compiler
from joulepath.optimizer.native.library_cache import work_folder
from tests.app.forks import run
from tests.optimizer.dynamics.kernel_states import LOSSY, TASK, TORQUE, states
from tests.optimizer.moves import GOAL, ROBOT, START, problem, torques
from tests.selection import long_but

pytestmark = pytest.mark.usefixtures("compiler")
SWAP = 60.0  # s; a compilation without optimisation takes one to three
ALL_COMPILED = 400.0  # s; of every robot, beside other work


@pytest.fixture(scope="module")
def whole() -> Path:
    """The library as it is in use."""
    return compile_kernel(ROBOT)


def test_the_digest_tells_chains_apart() -> None:
    """Compiled-in values change the digest; parameters passed by a request do not."""
    same = replace(
        ROBOT, drives=LOSSY, electronics=replace(ROBOT.electronics, idle_power=1.0), title="another"
    )
    assert digest(same, PORTABLE) == digest(ROBOT, PORTABLE)
    heavier, longer, turned = ROBOT.model.copy(), ROBOT.model.copy(), ROBOT.model.copy()
    heavier.inertias[3] = pin.Inertia(
        1.01 * heavier.inertias[3].mass, heavier.inertias[3].lever, np.eye(3)
    )
    longer.jointPlacements[2].translation = longer.jointPlacements[2].translation + np.array(
        [1e-4, 0, 0]
    )
    turned.frames[turned.getFrameId("flange")].placement = pin.SE3.Random()
    models = (ROBOT.model, heavier, longer, turned)
    digests = {
        digest(replace(ROBOT, model=model), using) for model in models for using in (PORTABLE, AVX2)
    }
    assert len(digests) == 8


def test_the_digest_covers_every_source_that_runs_while_the_c_is_written() -> None:
    ours, ran = Path(joulepath.__file__).parent, set[str]()

    def note(frame: FrameType, event: str, argument: object) -> None:
        ran.add(frame.f_code.co_filename)

    sys.setprofile(note)
    try:
        source(build(ROBOT), 2)
    finally:
        sys.setprofile(None)
    sources = {Path(str(module.__file__)).resolve() for module in SOURCE_MODULES}
    rooms = [(ours / part).resolve() for part in ("optimizer", "models")]
    files = {Path(file).resolve() for file in ran}
    assert {file for file in files if any(map(file.is_relative_to, rooms))} == sources


@dataclass
class Workshop:
    """A separate cache directory and a compiler that counts its calls; `robot` is loaded here for
    the first time.
    """

    folder: Path
    robot: Robot

    @property
    def compilations(self) -> int:
        log = self.folder / "calls"
        return len(log.read_text().splitlines()) if log.exists() else 0

    @property
    def libraries(self) -> list[str]:
        return sorted(map(str, (self.folder / "cache").glob("*.so")))

    def leftovers(self) -> list[str]:
        """Files in the cache besides the library, its seal and its lock."""
        known = {".so", ".sha256", ".lock"}
        return [path.name for path in (self.folder / "cache").iterdir() if path.suffix not in known]


@pytest.fixture
def workshop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workshop:
    kernel_for(ROBOT)  # from the folder that the other tests have
    real = compiler()
    assert real is not None, "make installs a compiler where there is none"
    script = tmp_path / "compiler"
    script.write_text(
        f'#!/bin/sh\necho call >> {tmp_path}/calls\nexec {real} "$@" -O0 -fno-sanitize=undefined\n'
    )
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "cache"))
    return Workshop(tmp_path, replace(ROBOT))


def no_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("PATH", str(tmp_path))


def wait_until_compiled(robot: Robot) -> Kernel:
    end = time.monotonic() + SWAP
    while not (found := kernel_for(robot)).compiled:
        assert time.monotonic() < end, "the compiled kernel is never swapped in"
        time.sleep(0.05)
    return found


def assert_right(found: Kernel) -> None:
    y = states(6)
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    assert (
        np.abs(found.torque(q, v, a, TASK.parameters()) - torques(TASK.problem, q, v, a)).max()
        < TORQUE
    )


def test_a_portable_kernel_is_used_where_there_is_no_other(
    workshop: Workshop, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made = compile_kernel(workshop.robot, portable=True)
    assert (
        compile_kernel(workshop.robot, portable=True)
        == made
        == library_path(workshop.robot, PORTABLE)
    )
    assert workshop.compilations == 1
    no_compiler(monkeypatch, tmp_path)
    found = kernel_for(workshop.robot)
    assert found.compiled
    assert_right(found)


def test_the_virtual_machine_serves_while_the_compiler_runs(workshop: Workshop) -> None:
    """The first call does not wait; when the library is there, it is swapped in, and it has been
    compiled once.
    """
    first = kernel_for(workshop.robot)
    assert not first.compiled
    assert_right(first)
    assert kernel_for(workshop.robot) is first or kernel_for(workshop.robot).compiled
    swapped = wait_until_compiled(workshop.robot)
    assert_right(swapped)
    assert kernel_for(workshop.robot) is swapped
    assert workshop.compilations == 1 and workshop.leftovers() == []
    assert kernel_for(replace(ROBOT)).compiled  # whoever comes later finds it


def test_threads_that_come_at_once_share_one_kernel(workshop: Workshop) -> None:
    """The first thread loads or builds the kernel, and it is compiled once."""
    count = 8
    together = threading.Barrier(count)

    def first_torques(_: int) -> Kernel:
        together.wait()
        found = kernel_for(workshop.robot)
        for _ in range(20):
            assert_right(kernel_for(workshop.robot))
        return found

    with ThreadPoolExecutor(count) as executor:
        assert len(set(executor.map(first_torques, range(count)))) == 1
    wait_until_compiled(workshop.robot)
    assert workshop.compilations == 1
    with ThreadPoolExecutor(count) as executor:
        assert {found.compiled for found in executor.map(first_torques, range(count))} == {True}


@pytest.mark.parametrize(
    "damage",
    long_but(("flipped",), ("truncated", "flipped", "seal gone", "seal garbled", "library gone")),
)
def test_a_damaged_library_is_noticed_and_rebuilt(
    workshop: Workshop, whole: Path, damage: str
) -> None:
    library = workshop.folder / "cache" / whole.name
    library.parent.mkdir()
    seal = library.with_suffix(".sha256")
    for original, copy in ((whole, library), (whole.with_suffix(".sha256"), seal)):
        shutil.copy(original, copy)
    compile_kernel(workshop.robot)
    assert workshop.compilations == 0  # nothing wrong with it yet
    content = library.read_bytes()
    middle = len(content) // 2
    match damage:
        case "truncated":
            library.write_bytes(content[:middle])
        case "flipped":
            library.write_bytes(
                content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]
            )
        case "seal gone":
            seal.unlink()
        case "seal garbled":
            seal.write_bytes(b"\xff" * 64)
        case "library gone":
            library.unlink()
    assert not kernel_for(workshop.robot).compiled
    assert_right(wait_until_compiled(workshop.robot))
    compile_kernel(workshop.robot)
    assert workshop.compilations == 1  # and is whole now


@pytest.mark.long
@pytest.mark.parametrize(
    "names", long_but([["ur5e"]], [["ur5e"], []]), ids=lambda names: ", ".join(names) or "all"
)
def test_several_processes_make_one_library_of_each_robot(
    workshop: Workshop, names: list[str]
) -> None:
    """Of three concurrent builds into an empty folder, one compiles and the others wait; no
    temporary files remain.
    """
    command = [
        sys.executable,
        "-W",
        "error::RuntimeWarning",
        "-m",
        "joulepath.optimizer.dynamics.precompile",
        *names,
    ]
    processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    printed = [process.communicate(timeout=ALL_COMPILED)[0].splitlines() for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert [sorted(each) for each in printed] == [workshop.libraries] * 3
    assert workshop.compilations == len(workshop.libraries) == len(names or robot_names())
    assert workshop.leftovers() == []
    assert kernel_for(workshop.robot).compiled


@pytest.mark.long
def test_what_a_killed_process_left_is_deleted(workshop: Workshop) -> None:
    target = library_paths(workshop.robot)[0]
    target.parent.mkdir()
    with work_folder(target) as folder:
        (folder / "kernel.c").write_text("half")
        left = shutil.copytree(folder, f"{folder}-killed.part")
    assert workshop.leftovers() == [left.removeprefix(f"{target.parent}/")]
    compile_kernel(workshop.robot)
    assert workshop.libraries == [str(target)] and not workshop.leftovers()


@pytest.mark.long
def test_a_short_script_with_an_empty_cache_ends_well(workshop: Workshop) -> None:
    """The virtual machine computes the answer; the script neither waits for the compiler nor fails
    because of it.
    """
    code = (
        "from joulepath import Arm, Problem, load_robot, optimize\n"
        f"arm, start, goal = Arm(robot=load_robot('ur5e')), {START.tolist()}, {GOAL.tolist()}\n"
        "print(optimize(Problem(arm=arm, start=start, goal=goal, "
        "deadline=100)).certificate.valid)\n"
    )
    ended = run(("-c", code), os.environ, patience=120.0)
    assert (ended.returncode, ended.stdout.strip(), ended.stderr) == (0, b"True", b"")


def test_without_a_compiler_the_virtual_machine_serves(
    workshop: Workshop, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The answer is the same as with a compiler."""
    no_compiler(monkeypatch, tmp_path)
    assert compiler() is None
    with pytest.raises(RuntimeError, match="compiler"):
        compile_kernel(workshop.robot)
    assert not kernel_for(workshop.robot).compiled
    by_hand = optimize(problem(robot=workshop.robot))
    assert not kernel_for(workshop.robot).compiled
    assert by_hand.certificate.valid
    assert by_hand.energy.electrical.total == pytest.approx(
        optimize(problem()).energy.electrical.total, rel=1e-6
    )


@pytest.mark.parametrize("trouble", ["compiler fails", "cache cannot be written"])
def test_trouble_while_compiling_is_logged_and_survived(
    workshop: Workshop,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    trouble: str,
) -> None:
    if trouble == "compiler fails":
        monkeypatch.setenv("CC", "false")
    else:
        (tmp_path / "file").touch()
        monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert not kernel_for(workshop.robot).compiled
    end = time.monotonic() + SWAP
    while not caplog.records:
        assert time.monotonic() < end
        time.sleep(0.02)
    # the handler notes the record first, and its text later
    assert "CasADi interprets it" in caplog.records[0].getMessage()
    found = kernel_for(workshop.robot)
    assert not found.compiled
    assert_right(found)


def test_a_folder_that_cannot_be_looked_into_is_no_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Like another user's home; a name that is too long has this effect for root as well."""
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", f"/{'x' * 300}")
    loader = kernel._Loader(ROBOT)
    loader._interpreted = kernel_for(ROBOT)
    assert loader.get() is loader._interpreted
