"""Commands that run until they are stopped: `joulepath serve`, `cluster-worker` and `ros2`."""

from __future__ import annotations

import asyncio
import os

import click


@click.command(
    epilog="""\b
Exit codes:
    0  ended by SIGTERM or Ctrl-C
    1  a setting is wrong, or another program has the port: see standard error for the remedy
    2  wrong usage
    3  the service cannot start: the log on standard error says why

\b
Example:
  joulepath serve --port 8080"""
)
@click.option(
    "--host", help="Address to listen on. Default: JOULEPATH_HOST, or 127.0.0.1: this machine only."
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="TCP port. Default: JOULEPATH_PORT or PORT, or 8000.",
)
def serve(host: str | None, port: int | None) -> None:
    """Starts the HTTP service, as `python -m joulepath.app` does.

    All other settings are environment variables, see docs/reference/settings.md.
    """
    # worker processes read the settings, too
    if host is not None:
        os.environ["JOULEPATH_HOST"] = host
    if port is not None:
        os.environ["JOULEPATH_PORT"] = str(port)

    from joulepath.app.__main__ import main

    main()


@click.command(
    epilog="""\b
Example:
  joulepath cluster-worker tcp://scheduler:8786"""
)
@click.argument("scheduler")
def cluster_worker(scheduler: str) -> None:
    """Works on jobs for the Dask scheduler at SCHEDULER, `tcp://HOST:PORT`.

    JOULEPATH_WORKERS processes compute, by default one per CPU. Services with
    JOULEPATH_CLUSTER=SCHEDULER send the work. SIGTERM and Ctrl-C end the command with 0; other
    machines repeat its unfinished work.
    """
    from joulepath.app.settings import WrongSettings, read_settings

    try:
        settings = read_settings({"cluster": scheduler})
    except WrongSettings as error:
        raise click.UsageError(str(error)) from None

    from joulepath.app.cluster.dask_worker import serve
    from joulepath.app.engine.forkserver import start_forkserver
    from joulepath.app.logs import configure_logging

    start_forkserver()
    configure_logging(settings.log_level)
    asyncio.run(serve(scheduler, settings))


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
    from joulepath.optimizer.presentation.extras import required

    try:
        required("rclpy", "joulepath ros2", "joulepath[ros2]")
    except ModuleNotFoundError as error:
        raise click.ClickException(str(error)) from None
    from joulepath.app.ros2.node import main

    main(list(arguments))
