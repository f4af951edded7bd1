"""`joulepath robots`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from joulepath.app.cli.answer import OUTPUT, write
from joulepath.app.cli.store import in_store, robot_named
from joulepath.app.cli.terminal import table

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from joulepath.models.robot import Robot


@click.group(
    invoke_without_command=True,
    epilog="""\b
Examples:
  joulepath robots
  joulepath robots add my_arm.yaml""",
)
@click.pass_context
def robots(context: click.Context) -> None:
    """Lists the available robots; adds and removes robots of your own.

    The columns are the name, the title, the number of joints, the rated payload [kg], and the trust
    letters of the parameters behind energies. A: published by the manufacturer, B: fitted
    to measured data, C: from a paper or a third party's file, second-hand, T: transferred from a
    sister robot, E: engineering default without a source.
    """
    if context.invoked_subcommand is None:
        write(_table().encode(), None)


@robots.command(
    epilog="""\b
Example:
  joulepath robots add my_arm.yaml --replace"""
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--name", help="Name in requests. Default: that of FILE.")
@click.option("--replace", is_flag=True, help="Replace a robot of this name that was added before.")
def add(file: Path, name: str | None, replace: bool) -> None:
    """Adds an arm of your own to the database of the service: JOULEPATH_DATABASE_URL.

    FILE is a YAML file with the path of a URDF and further figures: see
    docs/reference/own_robot.md.
    """
    from joulepath.app.access.client import OPERATOR
    from joulepath.app.api.robots.request import NAME_PATTERN
    from joulepath.app.settings import Settings
    from joulepath.app.store import robots as stored
    from joulepath.app.store.tables import OwnRobot, now
    from joulepath.models.own_arm.description import InvalidArm
    from joulepath.models.own_arm.figures import own_figures
    from joulepath.models.own_arm.reading import read_description
    from joulepath.models.trust import energy_trust
    from joulepath.optimizer.exceptions import InvalidProblem

    name = file.stem if name is None else name
    if not NAME_PATTERN.fullmatch(name):
        raise click.UsageError(
            "The name must have small letters, digits, - and _ only: give another one by --name."
        )
    try:
        stored.check_own(name)
        figures, warnings = own_figures(name, read_description(file))
        row = OwnRobot(name=name, created=now(), figures=figures, warnings=warnings)
        most = Settings().max_robots
        work: Callable[[Session], object] = partial(stored.add, robot=row, most=most)
        if replace:
            work = partial(stored.put, robot=row, most=most, client=OPERATOR)
        in_store(lambda store: store.write(work))
    except InvalidArm as error:
        raise InvalidProblem(error.field, str(error)) from None
    joints = len(figures["kinematics"]["joint_names"]["value"])
    write(
        "\n".join([f"{name}: {joints} joints. {energy_trust(figures)}", *warnings]).encode(), None
    )


@robots.command(
    epilog="""\b
Example:
  joulepath robots remove my_arm"""
)
@click.argument("name")
def remove(name: str) -> None:
    """Deletes an added robot. Studies and stored answers about it stay."""
    from joulepath.app.access.client import OPERATOR
    from joulepath.app.store import robots as stored

    in_store(lambda store: store.write(partial(stored.delete, name=name, client=OPERATOR)))


@robots.command(
    epilog="""\b
Examples:
  joulepath robots mjcf ur5e --output ur5e.xml
  joulepath robots mjcf my_arm.yaml --output my_arm.xml"""
)
@click.argument("robot")
@OUTPUT
def mjcf(robot: str, output: Path | None) -> None:
    """Writes a robot as an MJCF file for MuJoCo.

    ROBOT is the name of a robot, or the path of a YAML file that describes one. The file has rotor
    inertias and friction, so that MuJoCo's torques are those of the answers.
    """
    from joulepath.models.mjcf import mjcf as written

    write(written(_robot(robot)).encode(), output)


@robots.command(
    "joint-limits",
    epilog="""\b
Examples:
  joulepath robots joint-limits ur5e --output joint_limits.yaml
  joulepath robots joint-limits ur5e --mass 3 --distance 0.1 --prefix left_""",
)
@click.argument("robot")
@click.option(
    "--mass", type=float, help="Largest mass of the payload [kg]. Default: the rated one."
)
@click.option(
    "--distance",
    type=float,
    default=0.0,
    help="Distance of its centre of mass from the flange, along the flange's z axis [m].",
)
@click.option("--prefix", default="", help="Prefix of all joint names.")
@OUTPUT
def joint_limits(
    robot: str, mass: float | None, distance: float, prefix: str, output: Path | None
) -> None:
    """Writes the joint_limits.yaml that a robot's torques imply, for MoveIt and ros2_control.

    ROBOT is as for `mjcf`. The limits are proven for every posture, all speeds and accelerations
    within them, and every payload up to the mass.
    """
    from joulepath.app.api.robots.joint_limits import proven_limits

    write(proven_limits(_robot(robot), mass, distance).to_yaml(prefix).encode(), output)


def _robot(robot: str) -> Robot:
    """The robot of a name or of a file. Raises DeclaredError or click.FileError."""
    from joulepath.models.own_arm.description import InvalidArm
    from joulepath.optimizer.exceptions import InvalidProblem
    from joulepath.optimizer.problem.robots import DESCRIPTIONS, load_robot

    try:
        return load_robot(robot) if robot.endswith(DESCRIPTIONS) else robot_named(robot)
    except InvalidArm as error:
        raise InvalidProblem(error.field, str(error)) from None
    except OSError as error:
        raise click.FileError(robot, error.strerror or str(error)) from None


def _table() -> str:
    """Bundled robots, then added ones if the database answers."""
    from joulepath.app.exceptions.stored import StoreUnavailable
    from joulepath.app.store import robots as stored
    from joulepath.models.registry import robot_names
    from joulepath.models.trust import ENERGY_SECTIONS, trust_letters
    from joulepath.optimizer.problem.robots import load_robot

    head = (
        "name",
        "title",
        "joints",
        "payload [kg]",
        *(f"trust: {part.replace('_', ' ')}" for part in ENERGY_SECTIONS),
    )
    found = {name: load_robot(name).figures for name in robot_names()}
    try:
        found |= {
            each.name: each.figures for each in in_store(lambda store: store.read(stored.all_of))
        }
    except StoreUnavailable as error:
        click.echo(f"Robots that were added are not listed. {error}", err=True)
    rows = [head]
    for name, figures in found.items():
        letters = (" ".join(sorted(trust_letters(figures[part]))) for part in ENERGY_SECTIONS)
        joints, payload = (
            figures["kinematics"]["joint_names"]["value"],
            figures["limits"]["rated_payload"]["value"],
        )
        rows.append((name, figures["title"], str(len(joints)), f"{payload:g}", *letters))
    return table(rows)
