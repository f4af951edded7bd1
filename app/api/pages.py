"""GET /studio, the page that shows motions, and GET /help, the pages of `docs/` as a site.

Both are static files, built before the start of the service, the site by `scripts/build_docs.py`.
"""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import PurePosixPath

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from joulepath.app.exceptions.transport import NotFound, PagesNotBuilt
from joulepath.app.http.weights import is_known

router = APIRouter(include_in_schema=False)

_HELP = "help"
_STUDIO = "studio"
_INDEX = "index.html"
_MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".ipynb": "application/json",
    ".csv": "text/csv; charset=utf-8",
    ".png": "image/png",
    ".woff2": "font/woff2",
}
# other linked files are shown as plain text
_TEXT = (".conf", ".service", ".sh", ".text", ".yaml")
_POLICY = (
    "default-src 'none'; script-src {scripts}; style-src {styles}; font-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
"""Everything from this service, and nothing inline but what was there when the page was built."""
STYLE = "style.digest"
"""Name of the file with the digest of the style sheet that a script adds to pages of a folder."""
_INLINE = re.compile(rb"<script>(.*?)</script>", re.DOTALL)


@dataclass(frozen=True)
class _File:
    content: bytes
    media_type: str
    tag: str
    policy: str | None
    """Content-Security-Policy of a page; None for other files."""


@router.get("/help")
async def help_root() -> RedirectResponse:
    """Leads to the first page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("help/", status_code=307)


@router.get("/help/{path:path}")
async def help_page(request: Request, path: str) -> Response:
    """A page, with a slash at the end of its path, or a file of the site.

    The path of a page without the slash redirects to the page, because the links of a page are
    relative to its folder. The target of the redirect is only the last part of the path and cannot
    name another host.
    """
    if path.endswith("/") or not path:
        return _answer(request, _HELP, f"{path}{_INDEX}")
    if f"{path}/{_INDEX}" in _files(_HELP):
        query = f"?{request.url.query}" if request.url.query else ""
        return RedirectResponse(f"{path.rpartition('/')[2]}/{query}", status_code=307)
    return _answer(request, _HELP, path)


@router.get("/")
async def studio_root() -> RedirectResponse:
    """Leads to the page. The target is relative: it holds behind a proxy's path, too."""
    return RedirectResponse("studio", status_code=307)


@router.get("/studio")
async def studio_page(request: Request) -> Response:
    """The page itself."""
    return _answer(request, _STUDIO, _INDEX)


@router.get("/studio/{path:path}")
async def studio_asset(request: Request, path: str) -> Response:
    """A script, a style sheet or the first example of the page."""
    if not path:  # /studio/: the page's own addresses hold without the slash only
        return RedirectResponse("../studio", status_code=307)
    return _answer(request, _STUDIO, path)


def _answer(request: Request, folder: str, path: str) -> Response:
    """The file at a path below `app/static/FOLDER`.

    Raises:
        PagesNotBuilt: the folder does not exist.
        NotFound: the folder has no such file for browsers.
    """
    found = _files(folder).get(path)
    if found is None:
        raise NotFound if _files(folder) else PagesNotBuilt
    headers = {
        "ETag": found.tag,
        # revalidated on every load: a page and a script of different versions do not mix
        "Cache-Control": "no-cache",
        "X-Content-Type-Options": "nosniff",
    }
    if found.policy is not None:
        headers["Content-Security-Policy"] = found.policy
    if is_known(found.tag, request):
        return Response(status_code=304, headers=headers)
    return Response(found.content, media_type=found.media_type, headers=headers)


@cache
def _files(folder: str) -> dict[str, _File]:
    """Every file of a folder by its path. No other path is answered."""
    root = files("joulepath") / "app" / "static" / folder
    found, folders = {}, [(PurePosixPath(), root)] if root.is_dir() else []
    style = root / STYLE
    styles = f"'self' '{style.read_text(encoding='utf-8')}'" if style.is_file() else "'self'"
    while folders:
        path, inside = folders.pop()
        for entry in inside.iterdir():
            if entry.is_dir():
                folders.append((path / entry.name, entry))
            elif (media_type := _media_type(entry.name)) is not None:
                found[str(path / entry.name)] = _file(entry.read_bytes(), media_type, styles)
    return found


def _media_type(name: str) -> str | None:
    suffix = PurePosixPath(name).suffix
    return "text/plain; charset=utf-8" if suffix in _TEXT else _MEDIA_TYPES.get(suffix)


def _file(content: bytes, media_type: str, styles: str) -> _File:
    tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
    if not media_type.startswith("text/html"):
        return _File(content, media_type, tag, None)
    digests = (base64.b64encode(hashlib.sha256(each).digest()) for each in _INLINE.findall(content))
    scripts = " ".join(["'self'", *(f"'sha256-{each.decode()}'" for each in digests)])
    return _File(content, media_type, tag, _POLICY.format(scripts=scripts, styles=styles))
