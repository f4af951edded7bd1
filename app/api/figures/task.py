"""PUT /figures in a worker: the check of a document against the robot's own figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from joulepath.app.convert.arm import robot_named
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.common import Request, RobotName, described
from joulepath.app.schemas.examples.figures import COVARIANCE, DRIVES, FIGURES_ID, FRICTION, MAINS
from joulepath.app.schemas.examples.values import CREATED
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.uncertainty.document import InvalidFigures, merged, replaced_in
from joulepath.optimizer.exceptions import InvalidProblem

Section = dict[str, Any]
_Share = Annotated[float, Field(ge=0, le=1)]
NAMES = (
    "Paths of the parameters, with the index of the joint where a figure has one value each: "
    "`friction_laws.LAW.coulomb.0`, `drives.copper.2`, `electronics.idle_power`, `inertials.mx.1`."
)


class Covariance(Request):
    """Covariance of the identified parameters."""

    names: Annotated[list[str], Field(min_length=1, max_length=200)] = described(
        NAMES, None, COVARIANCE["names"]
    )
    matrix: Annotated[list[list[float]], Field(min_length=1, max_length=200)] = described(
        "Symmetric and positive semidefinite, in the units of the parameters.",
        "unit · unit",
        COVARIANCE["matrix"],
    )


def _section(what: str, example: Section) -> Any:
    return described(f"{what}. Null: the robot's own.", None, example, default=None)


class FiguresDocument(Request):
    """Figures of a robot, some of them identified on one arm, in the form of its `figures.yaml`.
    A figure has `value`, `unit`, `source`, `trust`, and `sd` if it was identified. Only friction
    laws, drives, electronics, mains and inertials may differ from the robot's own."""

    robot: RobotName = described("Name of the robot.", None, "ur5e")
    friction_laws: Section | None = _section(
        "Friction laws by name; the first one is the default", FRICTION
    )
    drives: Section | None = _section("Motors, gears and inverters", DRIVES)
    electronics: Section | None = _section("Electronics", {})
    mains: Section | None = described(
        "What the control box draws from the mains: `factor` [1] times the energy of the arm's "
        "bus, and a `constant` power [W]. Null: not known.",
        None,
        MAINS,
        default=None,
    )
    inertials: Section | None = _section("Masses, centres of mass and inertias of the links", {})
    covariance: Covariance | None = described(
        "Covariance of the identified parameters. Null: none was identified.",
        None,
        COVARIANCE,
        default=None,
    )
    session_sd: _Share | Annotated[list[_Share], Field(max_length=16)] | None = described(
        "Relative standard deviation of friction from one day to another, common to all joints, "
        "or one per joint.",
        "1",
        0.03,
        default=None,
    )
    move_sd: Annotated[float, Field(ge=0, le=1e5)] | None = described(
        "Standard deviation of the effects outside the model, as a mean power of a motion.",
        "W",
        1.5,
        default=None,
    )
    title: str | None = described(
        "Manufacturer and model. Null: the robot's own.",
        None,
        "Universal Robots UR5e",
        default=None,
    )
    kinematics: Section | None = _section("As the robot's own", {})
    limits: Section | None = _section("As the robot's own", {})
    collision: Section | None = _section("As the robot's own", {})
    default_motion: Section | None = _section("As the robot's own", {})
    friction_table: Section | None = _section("As the robot's own", {})
    id: str | None = described(
        "Has no effect: the id follows from the content.", None, FIGURES_ID, default=None
    )
    created: str | None = described("Has no effect.", None, CREATED, default=None)
    owner: str | None = described("Has no effect.", None, "press_shop", default=None)
    parameters: int | None = described("Has no effect.", "1", 2, default=None)

    def document(self) -> dict[str, Any]:
        """The document with its given fields alone."""
        return self.model_dump(exclude={"id", "created", "owner", "parameters"}, exclude_none=True)


@dataclass(frozen=True)
class FiguresTask:
    """A document, and the request's id."""

    request: FiguresDocument
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The replacing figures as JSON, in milliseconds without a watch on `deadline`.

        Raises UnknownRobot, or InvalidProblem with the place or if no figure differs.
        """
        content = replacing(self.request.robot, self.request.document())
        if all(section == {} for section in content.values()):
            raise InvalidProblem(
                "robot",
                f"No figure differs from those of {self.request.robot}: give friction_laws, "
                "drives, electronics, mains or inertials of your own arm.",
            )
        return TaskResult.of_json(content)


def replacing(name: str, document: dict[str, Any]) -> dict[str, Any]:
    """Figures of a document replacing the robot's own. Raises UnknownRobot or InvalidProblem."""
    robot = robot_named(name)
    try:
        content = replaced_in(robot.name, robot.figures, document)
        own_robot(robot.name, merged(robot.figures, content))
    except InvalidFigures as error:
        raise InvalidProblem(error.field or "robot", str(error)) from None
    return content
