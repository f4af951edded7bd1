"""`joulepath ros2`."""

from __future__ import annotations

import click

from joulepath.app.cli.answer import refused


@click.command(
    context_settings={"ignore_unknown_options": True},
    epilog="""\b
Examples:
  joulepath ros2 --ros-args -p robot:=ur5e
  joulepath ros2 --ros-args -p robot:=ur5e \\
    -r '~/trajectory:=/joint_trajectory_controller/joint_trajectory'""",
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def ros2(arguments: tuple[str, ...]) -> None:
    """Starts a ROS 2 node that plans motions, see docs/reference/ros2.md.

    ARGUMENTS are those of any node: --ros-args, then parameters and remappings. Needs the packages
    of joulepath[ros2], or an installation of ROS 2.
    """
    from joulepath.optimizer.exceptions import DeclaredError
    from joulepath.optimizer.presentation.extras import required

    try:
        required("rclpy", "joulepath ros2", "joulepath[ros2]")
    except ModuleNotFoundError as error:
        raise click.ClickException(str(error)) from None
    from joulepath.app.ros2.node import main

    try:
        main(list(arguments))
    except DeclaredError as error:
        raise refused(error) from None
