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
    """Has this machine work on jobs for the Dask scheduler at SCHEDULER, `tcp://HOST:PORT`.

    JOULEPATH_WORKERS processes compute, by default one for each CPU. Services with
    JOULEPATH_CLUSTER=SCHEDULER send the work. SIGTERM and Ctrl-C end it with 0: what it is at work
    on is then done elsewhere.
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
