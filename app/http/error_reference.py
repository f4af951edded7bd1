"""The page docs/errors.md: `python -m joulepath.app.http.error_reference > docs/errors.md` writes it."""

from __future__ import annotations

import sys

from joulepath.app.http.problems import occasion, own_fields, types_of_error
from joulepath.optimizer.exceptions import DeclaredError

_HEAD = """\
# Errors
Every error is an `application/problem+json` document (RFC 9457) with `type`, `title`, `status`, `detail`, `instance`
(the id of the request) and the fields in this table. `type` is the path of a page that explains it, for example
`/problems/duration-too-short`. Types with the status 429 or 503 come with the header `Retry-After` [s].

This page is written by `python -m joulepath.app.http.error_reference`, from the classes of the errors.

| type | status | when | what to do | fields |
| --- | --- | --- | --- | --- |
"""


def page() -> str:
    """The page with one row for each type of error."""
    return _HEAD + "".join(_row(kind) for kind in types_of_error())


def _row(kind: type[DeclaredError]) -> str:
    fields = "<br>".join(f"`{name}`: {meaning}" for name, meaning in own_fields(kind).items())
    return f"| `{kind.slug()}` | {kind.status} | {occasion(kind)} | {kind.remedy} | {fields} |\n"


if __name__ == "__main__":
    sys.stdout.write(page())
