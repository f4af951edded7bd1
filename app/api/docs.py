"""GET /docs. It works without internet: its scripts come from a package."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, JSONResponse, Response

from joulepath.app.exceptions.transport import NotFound
from joulepath.app.http.openapi_short import short_document

router = APIRouter(include_in_schema=False)

_ASSETS = {
    "swagger-ui-bundle.js": "text/javascript",
    "swagger-ui.css": "text/css",
    "page.css": "text/css",
    "page.js": "text/javascript",
}
# The browser blocks external resources of later versions of the scripts.
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'unsafe-inline'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data:; worker-src 'self' blob:; "
    # no page of another site has its users click here unawares
    "frame-ancestors 'none'"
}


@router.get("/docs")
async def swagger() -> HTMLResponse:
    """Swagger UI. Its addresses are relative: they hold behind a proxy's path, too."""
    return HTMLResponse(_read("page.html"), headers=_HEADERS)


@router.get("/docs/openapi.json")
def document(request: Request) -> JSONResponse:
    """The short document, which Swagger UI opens at once; the complete one takes it seconds."""
    return JSONResponse(short_document(request.app.openapi()))


@router.get("/docs/{name}")
def asset(name: str) -> Response:
    """A script or style sheet of the page: our own, or of Swagger UI."""
    if name not in _ASSETS:
        raise NotFound
    return Response(
        _read(name), media_type=_ASSETS[name], headers={"Cache-Control": "max-age=86400"}
    )


@cache
def _read(name: str) -> bytes:
    own = files("joulepath") / "app" / "static" / "docs" / name
    packaged = files("fastapi_offline") / "static" / name
    return own.read_bytes() if own.is_file() else packaged.read_bytes()
