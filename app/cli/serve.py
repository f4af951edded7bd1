"""`joulepath serve`."""

from __future__ import annotations

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
