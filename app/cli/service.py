"""Common parts of commands for a running service: its address and its client."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

_URL = click.option(
    "--url",
    envvar="JOULEPATH_URL",
    default="http://127.0.0.1:8000",
    help="Address of the service. Default: JOULEPATH_URL, or http://127.0.0.1:8000.",
)
_KEY = click.option(
    "--key", envvar="JOULEPATH_API_KEY", help="API key of the service. Default: JOULEPATH_API_KEY."
)


def SERVICE(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a group of commands: address and key of the service."""
    return _URL(_KEY(command))


def connect(context: click.Context, url: str, key: str | None) -> None:
    """Gives the commands of a group a client of the service, until they end."""
    from joulepath.app.client.client import Client

    try:
        context.obj = context.with_resource(Client(url, key))
    except ModuleNotFoundError as error:
        raise click.UsageError(str(error)) from None
