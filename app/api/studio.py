"""GET /studio: the page that shows motions. GET / leads there."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import PurePosixPath

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from joulepath.app.exceptions.transport import NotFound
from joulepath.app.http.entity_tag import is_known

router = APIRouter(include_in_schema=False)

PAGE = "index.html"
_MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".woff2": "font/woff2",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; font-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Everything from this service, and nothing inline."""


@dataclass(frozen=True)
class _File:
    content: bytes
    media_type: str
    tag: str


@router.get("/")
async def root() -> RedirectResponse:
    """Leads to the page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("studio", status_code=307)


@router.get("/studio")
async def page(request: Request) -> Response:
    """The page itself."""
    return _answer(request, PAGE)


@router.get("/studio/{path:path}")
async def asset(request: Request, path: str) -> Response:
    """A script, a style sheet or the first example of the page."""
    return _answer(request, path)


def _answer(request: Request, path: str) -> Response:
    found = _files().get(path)
    if found is None:
        raise NotFound
    headers = {
        "ETag": found.tag,
        # asked for anew each time, so that no page of one version meets a script of another
        "Cache-Control": "no-cache",
        "X-Content-Type-Options": "nosniff",
    }
    if path == PAGE:
        headers["Content-Security-Policy"] = POLICY
    if is_known(found.tag, request):
        return Response(status_code=304, headers=headers)
    return Response(found.content, media_type=found.media_type, headers=headers)


@cache
def _files() -> dict[str, _File]:
    """Every file of the page by its path; nothing else can be asked for."""
    found, folders = {}, [(PurePosixPath(), files("joulepath") / "app" / "static" / "studio")]
    while folders:
        path, folder = folders.pop()
        for entry in folder.iterdir():
            if entry.is_dir():
                folders.append((path / entry.name, entry))
            elif (media_type := _MEDIA_TYPES.get(PurePosixPath(entry.name).suffix)) is not None:
                content = entry.read_bytes()
                tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
                found[str(path / entry.name)] = _File(content, media_type, tag)
    return found
