"""GET /problems/{type}: pages about types of problems, referenced by their field `type`."""

from __future__ import annotations

import re
from functools import cache
from html import escape
from typing import Annotated

import orjson
from fastapi import APIRouter, Path
from fastapi.responses import HTMLResponse

from joulepath.app.engine.result import json_document
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.transport import NotFound
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.problems import occasion, own_fields, problem_of
from joulepath.app.schemas.examples.problems import example_of
from joulepath.app.schemas.examples.values import REQUEST_ID
from joulepath.optimizer.exceptions import DeclaredError

router = APIRouter(prefix="/problems", tags=["problems"])

_STYLE = (
    "body{font:1rem/1.5 sans-serif;max-width:42rem;margin:3rem auto;padding:0 "
    "1rem}dt{margin-top:.5rem}pre{overflow:auto;background:#eee;padding:.5rem}"
)


@router.get(
    "/{slug}",
    summary="Meaning of a problem type",
    response_class=HTMLResponse,
    responses=problem_responses(NotFound),
)
async def explain_problem(
    slug: Annotated[
        str, Path(description="Last part of the `type` of a problem.", examples=["invalid-request"])
    ],
) -> HTMLResponse:
    """Explains a type of problem on an HTML page."""
    if slug not in _types():
        raise NotFound
    return HTMLResponse(_page(slug))


@cache
def _types() -> dict[str, type[DeclaredError]]:
    return {kind.slug(): kind for kind in types_of_error()}


@cache
def _page(slug: str) -> str:
    kind = _types()[slug]
    fields = "".join(
        f"<dt><code>{name}</code></dt><dd>{_text(meaning)}</dd>"
        for name, meaning in own_fields(kind).items()
    )
    document = json_document(problem_of(example_of(kind), REQUEST_ID))
    example = orjson.dumps(orjson.loads(document), option=orjson.OPT_INDENT_2).decode()
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(kind.title)}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{_STYLE}</style><main><h1>{escape(kind.title)}</h1>"
        f"<p><code>{slug}</code>, HTTP status {kind.status}</p>"
        f"<p>{_text(occasion(kind))}</p><p>{_text(kind.remedy)}</p>"
        + (f"<h2>Additional fields</h2><dl>{fields}</dl>" if fields else "")
        + f'<h2>Example</h2><pre tabindex="0">{escape(example)}</pre>'
        f'<p><a href="../help/reference/errors/#{slug}">All errors</a></p></main>'
    )


def _text(markdown: str) -> str:
    """Escaped HTML; text between backquotes becomes code."""
    return re.sub("`(.+?)`", r"<code>\1</code>", escape(markdown))
