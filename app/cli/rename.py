"""`joulepath rename`."""

from __future__ import annotations

import click

from joulepath.app.cli.service import SERVICE, connect

KINDS = ("answers", "jobs", "studies", "logs", "identifications", "robots")


@click.command(
    epilog="""\b
Examples:
  joulepath rename jobs 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60 'Night run, cell 4'
  joulepath rename logs 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60
  joulepath rename robots my_arm 'Palletiser, hall 2'"""
)
@SERVICE
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("id")
@click.argument("name", required=False)
@click.pass_context
def rename(
    context: click.Context, url: str, key: str | None, kind: str, id: str, name: str | None
) -> None:
    """Renames the object ID of a service to NAME, or removes its name. The NAME of a robot is its
    title.

    This command needs a running service, and the extra `client` of the package.
    """
    connect(context, url, key)
    context.obj.rename(f"/{kind}/{id}", name)
