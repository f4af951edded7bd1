"""`joulepath cluster-worker`."""

from __future__ import annotations

import asyncio

import click


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
