"""GET /problems/{type}: the page that the `type` of a problem points to."""

from __future__ import annotations

import inspect
import re
from functools import cache
from html import escape
from typing import Annotated

from fastapi import APIRouter, Path
from fastapi.responses import HTMLResponse

from joulepath.app.exceptions import NotFound
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas import errors as problems
from joulepath.app.schemas.errors import PROBLEMS, ProblemDetails

router = APIRouter(prefix="/problems", tags=["problems"])

_PAGES = {problem.slug(): problem for problem in PROBLEMS}
_STYLE = "body{font:1rem/1.5 sans-serif;max-width:42rem;margin:3rem auto;padding:0 1rem}dt{margin-top:.5rem}"


@router.get(
    "/{slug}",
    summary="What a type of problem means",
    response_class=HTMLResponse,
    responses=problem_responses(problems.NotFound),
)
async def explain(
    slug: Annotated[str, Path(description="Last part of the `type` of a problem.", examples=["validation"])],
) -> HTMLResponse:
    """A page that explains a type of problem."""
    if slug not in _PAGES:
        raise NotFound
    return HTMLResponse(_page(_PAGES[slug]))


@cache
def _page(problem: type[ProblemDetails]) -> str:
    title, status = (problem.model_fields[name].default for name in ("title", "status"))
    explanation = inspect.cleandoc(problem.__doc__ or "")
    fields = "".join(
        f"<dt><code>{name}</code></dt><dd>{_text(problem.model_fields[name].description or '')}</dd>"
        for name in problem.own_fields()
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
        f"<h1>{escape(title)}</h1><p><code>{problem.slug()}</code>, HTTP status {status}</p>"
        f"<p>{_text(explanation)}</p>" + (f"<h2>Fields of its own</h2><dl>{fields}</dl>" if fields else "")
    )


def _text(markdown: str) -> str:
    """Escaped HTML; text between backquotes becomes code."""
    return re.sub("`(.+?)`", r"<code>\1</code>", escape(markdown))
