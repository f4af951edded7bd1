"""Answers of the routes under `/figures`."""

from __future__ import annotations

from datetime import datetime

from joulepath.app.api.figures.task import Covariance, Section
from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.examples.figures import DRIVES, FIGURES_ID, FRICTION, MAINS
from joulepath.app.schemas.examples.values import CREATED


class FiguresSummary(Response):
    """Figures of a robot identified on one arm."""

    id: str = described(
        "Id of the figures, for the field `figures` of a request.", None, FIGURES_ID
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    created: datetime = described("Time at which they were stored, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that stored them; null without one.", None, "press_shop"
    )
    parameters: int = described("Number of parameters in the covariance.", "1", 2)


class FiguresList(Response):
    """All identified figures."""

    figures: list[FiguresSummary] = part("The figures, newest first.")


class FiguresDetail(FiguresSummary):
    """A robot's `figures.yaml` with the identified figures in the place of its own, and their
    uncertainty.
    """

    title: str = described("Manufacturer and model.", None, "Universal Robots UR5e")
    kinematics: Section = described("Kinematics.", None, {})
    inertials: Section = described("Masses, centres of mass and inertias of the links.", None, {})
    limits: Section = described("Limits.", None, {})
    collision: Section = described("Shapes of the links.", None, {})
    default_motion: Section | None = described(
        "Default motion of the controller; null if unknown.", None, {}
    )
    drives: Section = described("Motors, gears and inverters.", None, DRIVES)
    electronics: Section = described("Electronics.", None, {})
    mains: Section | None = described(
        "What the control box draws from the mains; null if unknown.", None, MAINS
    )
    friction_table: Section = described("Measured friction torques of the robot.", None, {})
    friction_laws: Section = described(
        "Friction laws by name; the first one is the default.", None, FRICTION
    )
    covariance: Covariance | None = part(
        "Covariance of the identified parameters; null: none was identified."
    )
    session_sd: float | list[float] | None = described(
        "Relative standard deviation of friction from one day to another, common to all joints, "
        "or one per joint; null: not known.",
        "1",
        0.03,
    )
    move_sd: float | None = described(
        "Standard deviation of the effects outside the model, as a mean power of a motion; "
        "null: not known.",
        "W",
        1.5,
    )
