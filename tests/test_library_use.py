"""The names of `import joulepath`: a promise, documented, and cheap to import anywhere."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
import typing
from collections.abc import Iterator
from pathlib import Path

import pytest

import joulepath
import joulepath.optimizer

ROOT = Path(__file__).parents[1]
FUNCTIONS = {
    "capsule_between",
    "compare",
    "evaluate",
    "even_payload",
    "export",
    "identify",
    "inverse_kinematics",
    "joint_limits",
    "load_robot",
    "load_tool",
    "mjcf",
    "optimize",
    "optimize_many",
    "pareto",
    "place",
    "plan_cycle",
    "read_log",
    "replay",
    "robot_names",
    "tool_names",
    "what_if",
}
SERVICE = {"Client", "InvalidRequest", "ServiceError"}
"""What is there for services over HTTP."""
ERRORS = {
    "ContradictoryOrder",
    "CycleTooShort",
    "DeadlineExceeded",
    "DurationTooShort",
    "EffortNotUsable",
    "ExcitationInfeasible",
    "FormatUnsuitable",
    "GoalInCollision",
    "InCollision",
    "InvalidArm",
    "InvalidFigures",
    "InvalidProblem",
    "InvalidTable",
    "JoulepathError",
    "LogTooLarge",
    "MethodNotApplicable",
    "NoCollisionFreeTrajectory",
    "NoPowerChannel",
    "UnreachableTargets",
    "NoConfigurationFound",
    "NoJointLimits",
    "NoPlacement",
    "NoSequence",
    "NoTrajectory",
    "NotCertified",
    "NotExcited",
    "NothingHeldOut",
    "OrientationNotHeld",
    "OutsideLimits",
    "PathInfeasible",
    "ServiceUnreachable",
    "PayloadUnknown",
    "SingularPose",
    "StartInCollision",
    "StopInCollision",
    "TorqueInfeasible",
    "UnknownRobot",
    "UnknownTool",
    "UnreachablePose",
}
TYPES = {
    "Advice",
    "AnyOf",
    "Arm",
    "AsPlanned",
    "Attachment",
    "Baseline",
    "Box",
    "BranchFilter",
    "Bus",
    "CandidateReport",
    "CandidateStatus",
    "CandidateTried",
    "CandidatesFound",
    "Capsule",
    "Certificate",
    "Clearance",
    "ClosestPair",
    "Compared",
    "Comparison",
    "ConeOrientedPose",
    "Configuration",
    "Contact",
    "Coupling",
    "Cycle",
    "CycleBaseline",
    "CycleMove",
    "CycleSolution",
    "Cylinder",
    "Dropped",
    "Dwell",
    "ElectricalEnergy",
    "Energy",
    "EnergyInterval",
    "Evaluation",
    "ExportedFile",
    "FrankaOptions",
    "FreeOrder",
    "Front",
    "FrontSolver",
    "Group",
    "HalfSpace",
    "IKSolution",
    "IKSolutions",
    "Identification",
    "IdentificationOptions",
    "IdentifiedParameter",
    "Improved",
    "IntervalEnergy",
    "Inverter",
    "JointEnergy",
    "JointLimits",
    "KrlOptions",
    "LeastClearance",
    "LimitReport",
    "Limits",
    "LimitsInForce",
    "LimitsOptions",
    "Line",
    "Log",
    "LogMove",
    "LogOptions",
    "LogReading",
    "LogReport",
    "MapPoint",
    "McapOptions",
    "MechanicalEnergy",
    "Mesh",
    "Move",
    "Moved",
    "MoveitOptions",
    "Obstacle",
    "Optimized",
    "Outcome",
    "Payload",
    "PlacedPose",
    "FoundPlace",
    "PlacementSolution",
    "Places",
    "PlannedBaseline",
    "PlannedMotion",
    "PlannedTorques",
    "Points",
    "Pose",
    "Problem",
    "Program",
    "RapidOptions",
    "RecordedRows",
    "Recording",
    "Region",
    "Replay",
    "ReplayedChange",
    "ReplayedRun",
    "Rest",
    "Robot",
    "Ros2Options",
    "SampledPoses",
    "Samples",
    "SavingInterval",
    "SavingRange",
    "Scene",
    "SimulatedSaving",
    "Solution",
    "SolverReport",
    "Sphere",
    "Spline",
    "Stop",
    "StopPath",
    "StepsDone",
    "StorageUse",
    "TableOptions",
    "Tolerance",
    "Tool",
    "ToolCone",
    "ToolPath",
    "Trajectory",
    "TriangleMesh",
    "UnreachableTarget",
    "UrscriptOptions",
    "Validation",
    "Voxels",
    "Waypoints",
    "WeightedCycle",
    "WhatIf",
}


def test_the_public_names_are_a_promise() -> None:
    assert set(joulepath.__all__) == FUNCTIONS | ERRORS | TYPES | SERVICE
    assert all(callable(getattr(joulepath, name)) for name in FUNCTIONS)
    assert re.fullmatch(r"\d+\.\d+\.\d+", joulepath.__version__)


def test_the_stub_lists_each_name_once() -> None:
    stub = ast.parse((ROOT / "joulepath" / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [each for each in stub.body if isinstance(each, ast.ImportFrom)]
    imported = [alias.name for each in imports for alias in each.names]
    (listed,) = (each.value for each in stub.body if isinstance(each, ast.Assign))
    assert sorted(imported) == ast.literal_eval(listed) == sorted(joulepath.__all__)
    assert len(set(imported)) == len(imported)


def test_every_name_is_documented() -> None:
    """A dataclass without a docstring has its signature for one, which does not count."""
    for name in joulepath.__all__:
        text = getattr(joulepath, name).__doc__
        assert text and not text.startswith(f"{name}("), name


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_function_says_what_it_takes_returns_and_raises(name: str) -> None:
    function = inspect.unwrap(getattr(joulepath, name))
    text, parameters = inspect.getdoc(function) or "", inspect.signature(function).parameters
    assert "Returns:" in text or "Yields:" in text
    assert "Raises:" in text or not parameters
    arguments = text.partition("Args:\n")[2].partition("\n\n")[0]
    documented = [
        line.split(":")[0].strip() for line in arguments.splitlines() if line[4:5] not in ("", " ")
    ]
    assert documented == list(parameters)


def test_one_except_clause_catches_every_error() -> None:
    """All errors are a JoulepathError, except the errors of robot files, which are a ValueError."""
    of_files = {"InvalidArm", "InvalidFigures"}
    for name in ERRORS:
        base = ValueError if name in of_files else joulepath.JoulepathError
        assert issubclass(getattr(joulepath, name), base)
    for module in pkgutil.walk_packages(joulepath.optimizer.__path__, "joulepath.optimizer."):
        importlib.import_module(module.name)
    assert {
        each.__name__
        for each in subclasses(joulepath.JoulepathError)
        if not each.__name__.startswith("_")
    } <= ERRORS


def subclasses(base: type) -> Iterator[type]:
    for each in base.__subclasses__():
        yield each
        yield from subclasses(each)


def test_the_types_of_arguments_are_public() -> None:
    """Every type made by a caller is public; results of the library may have internal parts."""
    known = {getattr(joulepath, name) for name in TYPES}
    made = {joulepath.Robot, joulepath.Solution, joulepath.CycleSolution}
    # a protocol for the class of another package, and sections of paths, made by the library alone
    internal = {"DaskClient", "Section"}
    todo = [each for name in FUNCTIONS for each in argument_types(getattr(joulepath, name))]
    seen = set[type]()
    while todo:
        each = todo.pop()
        if each in seen:
            continue
        seen.add(each)
        assert each in known or each.__name__ in internal, each
        if dataclasses.is_dataclass(each) and each not in made:
            todo += [
                part for hint in typing.get_type_hints(each).values() for part in own_types(hint)
            ]


def argument_types(function: object) -> Iterator[type]:
    hints = typing.get_type_hints(inspect.unwrap(function))  # type: ignore[arg-type]
    for name, hint in hints.items():
        if name != "return":
            yield from own_types(hint)


def own_types(hint: object) -> Iterator[type]:
    """The classes of the library in an annotation."""
    if isinstance(hint, type) and hint.__module__.startswith("joulepath"):
        yield hint
    for part in typing.get_args(hint):
        yield from own_types(part)


def in_a_process(code: str, folder: Path) -> str:
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def python_of(page: Path) -> list[str]:
    """The Python code of a page or a script."""
    text = page.read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL) if page.suffix == ".md" else [text]


def test_pages_and_examples_use_the_public_names() -> None:
    pages = [
        ROOT / "README.md",
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "examples" / "library").glob("*.py"),
    ]
    imports = [
        (page.name, each.module, alias.name)
        for page in pages
        for code in python_of(page)
        for each in ast.walk(ast.parse(code))
        if isinstance(each, ast.ImportFrom) and (each.module or "").startswith("joulepath")
        for alias in each.names
    ]
    assert len(imports) > 50
    assert [
        each for each in imports if each[1] != "joulepath" or each[2] not in joulepath.__all__
    ] == []


def test_the_import_loads_nothing() -> None:
    heavy = (
        "casadi",
        "fastapi",
        "mujoco",
        "numpy",
        "pinocchio",
        "pydantic",
        "scipy",
        "joulepath.optimizer",
    )
    code = f"import sys, joulepath; print([each for each in {heavy} if each in sys.modules])"
    assert in_a_process(code, ROOT) == "[]"


def test_the_library_needs_no_web_framework() -> None:
    """With all names loaded, only the client and the errors of the service are loaded.

    Tasks, imported by workers and the command line, need the schemas alone.
    """
    code = """
import sys, joulepath
[getattr(joulepath, name) for name in joulepath.__all__ if name != "InvalidArm"]
heavy = {"fastapi", "httpx2", "pydantic", "sqlalchemy", "starlette", "uvicorn"}
of_the_library = heavy & sys.modules.keys()
import joulepath.app.api.optimize.task
print(of_the_library, {"fastapi", "sqlalchemy", "starlette"} & sys.modules.keys())
"""
    assert in_a_process(code, ROOT) == "set() set()"


def test_it_works_beside_packages_of_the_same_names(tmp_path: Path) -> None:
    """A user's folder may have its own `models` and `app`, and modules named like ours."""
    for package in ("app", "models", "optimizer"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("MINE = True\n", encoding="utf-8")
    for module in ("compare", "evaluate", "exceptions", "problem", "robot", "solution"):
        (tmp_path / f"{module}.py").write_text("MINE = True\n", encoding="utf-8")
    code = """
import app, compare, evaluate, exceptions, models, optimizer, problem, robot, solution
import joulepath
mine = (app, compare, evaluate, exceptions, models, optimizer, problem, robot, solution)
assert all(each.MINE for each in mine)
arm = joulepath.Arm(robot=joulepath.load_robot("ur5e"), collisions=False)
motion = joulepath.Waypoints([[0.0] * 6, [0.1] * 6], 1.0)
print(joulepath.evaluate(arm, motion).total.duration)
"""
    assert in_a_process(code, tmp_path) == "1.0"
