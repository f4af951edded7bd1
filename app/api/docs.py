"""GET /docs and GET /redoc. They work without internet: their scripts come from a package."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_redoc_html
from fastapi.responses import HTMLResponse, JSONResponse, Response

from joulepath.app.exceptions.transport import NotFound
from joulepath.app.http.openapi_short import short_document

router = APIRouter(include_in_schema=False)

_ASSETS = {
    "swagger-ui-bundle.js": "text/javascript",
    "swagger-ui.css": "text/css",
    "redoc.standalone.js": "text/javascript",
    "page.css": "text/css",
    "page.js": "text/javascript",
}
# a picture fetched by Redoc from the internet
_REDOC_LOGO = b"https://cdn.redoc.ly/redoc/logo-mini.svg"
_NO_PICTURE = "data:,"
# The browser blocks all other external resources of later versions of the scripts.
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'unsafe-inline'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data:; worker-src 'self' blob:; "
    # no page of another site has its users click here unawares
    "frame-ancestors 'none'"
}


_PAGE = "page.html"


@router.get("/docs")
async def swagger() -> HTMLResponse:
    """Swagger UI. Its addresses are relative: they hold behind a proxy's path, too."""
    return HTMLResponse(_read(_PAGE), headers=_HEADERS)


@router.get("/redoc")
async def redoc(request: Request) -> HTMLResponse:
    """Redoc. Its addresses are relative, too."""
    page = get_redoc_html(
        openapi_url="openapi.json",
        title=request.app.title,
        redoc_js_url="docs/redoc.standalone.js",
        redoc_favicon_url=_NO_PICTURE,
        with_google_fonts=False,
    )
    page.headers.update(_HEADERS)
    return page


@router.get("/docs/openapi.json")
def document(request: Request) -> JSONResponse:
    """The short document, which Swagger UI opens at once; the complete one takes it seconds."""
    return JSONResponse(short_document(request.app.openapi()))


@router.get("/docs/{name}")
def asset(name: str) -> Response:
    """A script or style sheet of the two pages: our own, or of Swagger UI and Redoc."""
    if name not in _ASSETS:
        raise NotFound
    return Response(
        _read(name), media_type=_ASSETS[name], headers={"Cache-Control": "max-age=86400"}
    )


@cache
def _read(name: str) -> bytes:
    own = files("joulepath") / "app" / "static" / "docs" / name
    packaged = files("fastapi_offline") / "static" / name
    content = own.read_bytes() if own.is_file() else packaged.read_bytes()
    return content.replace(_REDOC_LOGO, _NO_PICTURE.encode())
