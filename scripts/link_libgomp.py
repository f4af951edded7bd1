"""Provides Pinocchio with the OpenMP runtime libgomp.so.1.

The wheel of Pinocchio expects the library on the system, but Debian without a compiler does not
have it. The wheel of CasADi contains a copy under another name, so a link to this copy is created.
"""

from __future__ import annotations

import ctypes
import sysconfig
from pathlib import Path


def main() -> None:
    """Creates the link if the system does not have the library."""
    try:
        ctypes.CDLL("libgomp.so.1")
    except OSError:
        packages = Path(sysconfig.get_path("platlib"))
        # the search path in Pinocchio's libraries contains this folder
        link = packages / "cmeel.prefix" / "lib" / "libgomp.so.1"
        link.unlink(missing_ok=True)
        link.symlink_to(next((packages / "casadi").glob("libgomp-*.so*")))


if __name__ == "__main__":
    main()
