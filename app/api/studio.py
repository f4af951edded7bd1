"""GET /studio: the page that shows motions. GET / leads there."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from joulepath.app.api.shared.static_folder import INDEX, answer

router = APIRouter(include_in_schema=False)

FOLDER = "studio"


@router.get("/")
async def root() -> RedirectResponse:
    """Leads to the page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("studio", status_code=307)


@router.get("/studio")
async def page(request: Request) -> Response:
    """The page itself."""
    return answer(request, FOLDER, INDEX)


@router.get("/studio/{path:path}")
async def asset(request: Request, path: str) -> Response:
    """A script, a style sheet or the first example of the page."""
    if not path:  # /studio/: the page's own addresses hold without the slash only
        return RedirectResponse("../studio", status_code=307)
    return answer(request, FOLDER, path)
