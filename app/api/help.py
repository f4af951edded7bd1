"""GET /help: the pages of `docs/` as a site, built by `scripts/build_docs.py`."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from joulepath.app.api.shared.static_folder import INDEX, answer, has

router = APIRouter(include_in_schema=False)

FOLDER = "help"


@router.get("/help")
async def root() -> RedirectResponse:
    """Leads to the first page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("help/", status_code=307)


@router.get("/help/{path:path}")
async def page(request: Request, path: str) -> Response:
    """A page, with a slash at the end of its path, or a file of the site.

    The path of a page without the slash redirects to the page, because the links of a page are
    relative to its folder. The target of the redirect is only the last part of the path and cannot
    name another host.
    """
    if path.endswith("/") or not path:
        return answer(request, FOLDER, f"{path}{INDEX}")
    if has(FOLDER, f"{path}/{INDEX}"):
        query = f"?{request.url.query}" if request.url.query else ""
        return RedirectResponse(f"{path.rpartition('/')[2]}/{query}", status_code=307)
    return answer(request, FOLDER, path)
