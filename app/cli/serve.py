"""`joulepath serve`."""

from __future__ import annotations

import os

import click


@click.command(
    epilog="""\b
Example:
  joulepath serve --port 8080"""
)
@click.option("--host", help="Address to listen on. Default: JOULEPATH_HOST, or 127.0.0.1: this machine only.")
@click.option("--port", type=click.IntRange(0, 65535), help="TCP port. Default: JOULEPATH_PORT or PORT, or 8000.")
def serve(host: str | None, port: int | None) -> None:
    """Starts the HTTP service, as `python -m app` does.

    All other settings are environment variables, see docs/settings.md. SIGTERM and Ctrl-C end the service with 0.
    """
    # worker processes read the settings, too
    if host is not None:
        os.environ["JOULEPATH_HOST"] = host
    if port is not None:
        os.environ["JOULEPATH_PORT"] = str(port)

    from app.__main__ import main

    main()
