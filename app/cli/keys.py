"""`joulepath keys`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from joulepath.app.cli.answer import write
from joulepath.app.cli.terminal import table

if TYPE_CHECKING:
    from joulepath.app.access.key_file import ApiKey

_FILE = click.option(
    "--file",
    type=click.Path(dir_okay=False, path_type=Path),
    envvar="JOULEPATH_API_KEYS_FILE",
    required=True,
    help="File of keys. Default: JOULEPATH_API_KEYS_FILE.",
)


@click.group(
    epilog="""\b
Examples:
  joulepath keys add press_shop --file keys.yaml
  joulepath keys list --file keys.yaml
  joulepath keys remove press_shop --file keys.yaml"""
)
def keys() -> None:
    """Creates, lists and removes API keys of the HTTP service.

    A service with JOULEPATH_API_KEYS_FILE=FILE answers requests with a key of this file only. A
    running service applies a change from its next request on.
    """


@keys.command(
    epilog="""\b
Example:
  joulepath keys add press_shop --role compute --file keys.yaml"""
)
@click.argument("name")
@click.option(
    "--role",
    type=click.Choice(["read", "compute", "admin"]),
    default="compute",
    show_default=True,
    help="read: look at everything. compute: also compute and create, and change what it created. "
    "admin: change all.",
)
@_FILE
def add(name: str, role: str, file: Path) -> None:
    """Creates a key for the client NAME and writes it once to standard output.

    The file holds its hash. Further keys of the same name are the same client: to replace a key,
    add another one, give it to the client, and remove the old one by its id.
    """
    from pydantic import ValidationError

    from joulepath.app.access.key_file import new_key

    try:
        secret, entry = new_key(name, role)  # type: ignore[arg-type]
    except ValidationError:
        raise click.UsageError(
            "NAME must have at most 64 letters, digits, '.', '_' and '-', and begin with a letter "
            "or digit."
        ) from None
    with _changing(file) as entries:
        entries.append(entry)
    click.echo(f"{entry.name}, role {entry.role}, id {entry.id}, in {file}", err=True)
    write(secret.encode(), None)


@keys.command(
    name="list",
    epilog="""\b
Example:
  joulepath keys list --file keys.yaml""",
)
@_FILE
def list_keys(file: Path) -> None:
    """Lists the keys: name, role, id and time. The keys themselves are not stored."""
    from joulepath.app.access.key_file import WrongKeyFile, read_keys

    try:
        entries = read_keys(file)
    except WrongKeyFile as error:
        raise click.UsageError(str(error)) from None
    rows = [(entry.name, entry.role, entry.id, entry.created.isoformat()) for entry in entries]
    write(table([("name", "role", "id", "created"), *rows]).encode(), None)


@keys.command(
    epilog="""\b
Example:
  joulepath keys remove press_shop --file keys.yaml"""
)
@click.argument("name_or_id", metavar="NAME|ID")
@_FILE
def remove(name_or_id: str, file: Path) -> None:
    """Removes all keys of a name, or the key with an id. Objects of its client stay."""
    with _changing(file) as entries:
        left = [entry for entry in entries if name_or_id not in (entry.name, entry.id)]
        if len(left) == len(entries):
            raise click.UsageError(
                f"{file} has no key of the name or id {name_or_id!r}: see `joulepath keys list`."
            )
        entries[:] = left


@contextmanager
def _changing(file: Path) -> Iterator[list[ApiKey]]:
    from joulepath.app.access.key_file import WrongKeyFile, changing

    try:
        with changing(file) as entries:
            yield entries
    except WrongKeyFile as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        raise click.UsageError(f"{file} cannot be written: {error.strerror}.") from None
