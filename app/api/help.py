"""GET /help: the pages of `docs/` as a site, which `scripts/build_docs.py` builds."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from joulepath.app.api.shared.static_folder import INDEX, answer

router = APIRouter(include_in_schema=False)

FOLDER = "help"


@router.get("/help")
async def root() -> RedirectResponse:
    """Leads to the first page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("help/", status_code=307)


@router.get("/help/{path:path}")
async def page(request: Request, path: str) -> Response:
    """A page, whose path ends with a slash, or a file of the site."""
    return answer(request, FOLDER, f"{path}{INDEX}" if path.endswith("/") or not path else path)
