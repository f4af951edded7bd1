"""`joulepath rename`."""

from __future__ import annotations

import click

from joulepath.app.cli.service import SERVICE, answered, connect

KINDS = ("answers", "jobs", "studies", "logs", "identifications")


@click.command(
    epilog="""\b
Examples:
  joulepath rename jobs 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60 'Night run, cell 4'
  joulepath rename logs 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"""
)
@SERVICE
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("id")
@click.argument("name", required=False)
@click.pass_context
def rename(
    context: click.Context, url: str, key: str | None, kind: str, id: str, name: str | None
) -> None:
    """Gives what a service keeps under ID another NAME, or none.

    This command needs a service that runs, and the extra `client` of the package.
    """
    connect(context, url, key)
    with answered():
        context.obj.rename(f"/{kind}/{id}", name)
