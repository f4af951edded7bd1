"""Version of the code; every update changes it, even between releases."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

import joulepath

_CODE = ("*.py", "*.c", "*.yaml")
_PAGES = ("static", "studio")
"""Folders of `app` without influence on answers. Node keeps thousands of files in one of them."""


@cache
def code_version(package: Path = Path(joulepath.__file__).parent) -> str:
    """A digest of the code and figures of an installation, by default the running installation.

    Answers and Python objects of another version may differ. Read first when the service starts:
    later, an update may have replaced files that this process does not use.
    """
    digest = hashlib.sha256()
    rooms = (each for each in (package / "app").iterdir() if each.name not in _PAGES)
    folders = (package / "models", package / "optimizer", *rooms)
    files = {file for folder in folders for kind in _CODE for file in folder.rglob(kind)}
    for file in sorted(files | set((package / "app").glob("*.py"))):
        digest.update(f"{file.relative_to(package)}\n".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
