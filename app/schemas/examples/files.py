"""Examples of requests and answers, from the files in the folder `examples` of the repository.

`examples/openapi/<path>.json` lists the requests of the OpenAPI document by the names of their
files in `examples/<path>`, with summary and description. The file also has an answer, unless the
models of the answer have examples of their own. It has no requests if a module of this package
defines them. The name of the file omits the parameters of a path; for a path with a parameter, the
files may be in folders, and the examples take the names of the folders.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

Example = dict[str, Any]
"""Summary, description and value, as in an OpenAPI document."""
_PARAMETER = re.compile(r"/\{[^}]*\}")
_MEDIA_TYPES = {".json": "application/json", ".csv": "text/csv"}


@cache
def folder() -> Path:
    """Folder of the examples: the copy in the wheel, or the folder of the repository."""
    app = Path(__file__).resolve().parents[2]
    installed = app / "static" / "examples"
    return installed if installed.is_dir() else app.parent / "examples"


@cache
def shown() -> dict[str, dict[str, Any]]:
    """Contents of `examples/openapi` by the path of the endpoint."""
    listed = folder() / "openapi"
    return {
        f"/{file.relative_to(listed).with_suffix('').as_posix()}": json.loads(
            file.read_text(encoding="utf-8")
        )
        for file in sorted(listed.rglob("*.json"))
    }


@cache
def body_examples(path: str) -> dict[str, dict[str, Example]]:
    """Examples of the body of a path: by media type, then by name."""
    found: dict[str, dict[str, Example]] = {}
    for name, words in shown()[path].get("requests", {}).items():
        file = folder() / _PARAMETER.sub("", path)[1:] / name
        text = file.read_text(encoding="utf-8")
        value = json.loads(text) if file.suffix == ".json" else text
        found.setdefault(_MEDIA_TYPES[file.suffix], {})[Path(Path(name).parts[0]).stem] = {
            **words,
            "value": value,
        }
    return found
