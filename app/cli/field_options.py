"""Options of commands, made from the fields of requests."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

import click

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from joulepath.app.schemas.common import Request

Fields = Mapping["type[Request]", Sequence[str]]
"""Names of fields by their requests."""


class Json(click.ParamType[dict[str, Any], Any]):
    """A mapping in JSON."""

    name = "JSON"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, Any]:
        """The mapping."""
        try:
            content = json.loads(value)
        except ValueError as error:
            self.fail(f"is no JSON: {error}", param, ctx)
        if not isinstance(content, dict):
            self.fail("must be a mapping, as {...}.", param, ctx)
        return content


class FieldCommand(click.Command):
    """A command with options made from fields of requests.

    An option without a value is None, or an empty tuple if repeatable; the field then keeps the
    default of the schema. The schema also checks ranges.
    """

    def __init__(self, *args: Any, fields: Callable[[], Fields], **settings: Any) -> None:
        """Takes the arguments of click.Command.

        Args:
            args: arguments by position.
            fields: function that returns the fields. Called at the first use, because the import
                of schemas takes long.
            settings: arguments by name.
        """
        super().__init__(*args, **settings)
        self._fields = fields

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Parameters of the command, then options of fields, then `--help`."""
        *own, help = super().get_params(ctx)
        return [*own, *self.field_options, help]

    @cached_property
    def field_options(self) -> list[click.Parameter]:
        """Options of the fields, in order."""
        return [
            _option(name, model.model_fields[name])
            for model, names in self._fields().items()
            for name in names
        ]


def given_fields(names: Sequence[str], options: Mapping[str, Any]) -> dict[str, Any]:
    """Values of the named fields, without options that have no value."""
    return {name: options[name] for name in names if options[name] not in (None, ())}


def _option(name: str, field: FieldInfo) -> click.Option:
    kind, multiple = _kind(field.annotation)
    text = [" ".join((field.description or "").split()).replace("Null:", "Default:")]
    if multiple:
        text.append("May be repeated.")
    if isinstance(kind, Json) and field.examples:
        text.append(f"Example: '{json.dumps(field.examples[0])}'.")
    if field.default is not None:
        default = field.default if isinstance(field.default, list) else [field.default]
        text.append(f"Default: {', '.join(map(str, default))}.")
    flag = f"--{name.replace('_', '-')}"
    return click.Option([flag, name], type=kind, multiple=multiple, help=" ".join(text))


def _kind(annotation: Any) -> tuple[Any, bool]:
    """The click type of a field's values, and whether the option is repeatable."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind(arguments[0])
    if origin in (Union, UnionType):
        (annotation,) = (each for each in arguments if each is not type(None))
        return _kind(annotation)
    if origin is Literal:
        return click.Choice(arguments), False
    if origin is list:
        kind, _ = _kind(arguments[0])
        return kind, True
    return (annotation if annotation in (float, int, str) else Json()), False
