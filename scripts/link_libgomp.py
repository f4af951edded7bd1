"""Gives Pinocchio the OpenMP runtime that its wheel takes for granted.

Pinocchio's wheel expects the system's libgomp.so.1, which a Debian without a compiler does not
have. CasADi's wheel brings a copy under a name of its own: where the system has none, a link lets
Pinocchio find that one.
"""

from __future__ import annotations

import ctypes
import sysconfig
from pathlib import Path


def main() -> None:
    """Make the link, unless the system has the library."""
    try:
        ctypes.CDLL("libgomp.so.1")
    except OSError:
        packages = Path(sysconfig.get_path("platlib"))
        # this folder is on the search path that is built into Pinocchio's libraries
        link = packages / "cmeel.prefix" / "lib" / "libgomp.so.1"
        link.unlink(missing_ok=True)
        link.symlink_to(next((packages / "casadi").glob("libgomp-*.so*")))


if __name__ == "__main__":
    main()
