"""Removes from an environment what only builds and tests need, and puts links where wheels hold
copies.

Wheels of C++ libraries carry headers, build files, static libraries and, since a wheel cannot hold
links, every shared library under two or three names. Where binutils are there, libraries that
nothing asks for and symbol tables go, too.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import shutil
import subprocess
from pathlib import Path

# Folders of the environment's site-packages that nothing reads at run time.
BUILD_FOLDERS = [
    "casadi/cbc",
    "casadi/clp",
    "casadi/cmake",
    "casadi/highs",
    "casadi/include",
    "casadi/pkgconfig",
    "casadi/tools",
    "cmeel.prefix/bin",
    "cmeel.prefix/include",
    "cmeel.prefix/lib/cmake",
    "cmeel.prefix/lib/pkgconfig",
    "cmeel.prefix/lib64/cmake",
    "cmeel.prefix/lib64/pkgconfig",
    "cmeel.prefix/share/doc",
    "matplotlib/mpl-data/sample_data",
    "mujoco/doc",
    "mujoco/include",
    "mujoco/introspect",
    "mujoco/studio",
    "mujoco/sysid",
    "mujoco/testdata",
    "mujoco/usd",
    "numpy/_core/include",
    "numpy/_core/lib",
]
BUILD_FILES = [
    "**/*.a",
    "**/*.la",
    "**/*.pyx",
    "**/*.pxd",
    "**/*.hpp",
    "**/tests",
    # its tests, its viewer, and many simulations at once
    "mujoco/*_test.py",
    "mujoco/_batch.*",
    "mujoco/_render_filament.*",
    "mujoco/_rollout.*",
    "mujoco/_simulate.*",
]
# CasADi's plugins of these kinds are many and heavy, and loaded by name: these stay.
CASADI_KINDS = ["archiver", "conic", "graphmodel", "modelicaparser", "nlpsol", "onnx"]
CASADI_PLUGINS = [
    "conic_daqp",
    "conic_qpoases",
    "conic_qrqp",
    "nlpsol_ipopt",
    "nlpsol_qrsqp",
    "nlpsol_sqpmethod",
]
# Libraries whose symbol tables weigh megabytes. Not all: stripping breaks those that wheel tools
# have relocated.
SYMBOLS = [
    "cmeel.prefix/lib/libeigenpy.so",
    "cmeel.prefix/lib/python*/site-packages/*/*_pywrap*.so",
    "uvloop/*.so",
]


def size(folder: Path) -> int:
    """Disk space of a folder's regular files [MiB]."""
    return (
        sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and not p.is_symlink()) >> 20
    )


def remove_build_files(packages: Path) -> None:
    """Remove headers, build files, static libraries and tests."""
    doomed = [packages / folder for folder in BUILD_FOLDERS]
    doomed += [path for pattern in BUILD_FILES for path in packages.glob(pattern)]
    for path in doomed:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def link_copies(folder: Path) -> None:
    """Put links in place of libraries that are equal but for their name."""
    first: dict[str, Path] = {}
    for path in sorted(folder.glob("*.so*")):
        if not path.is_symlink():
            original = first.setdefault(hashlib.sha256(path.read_bytes()).hexdigest(), path)
            if original != path:
                path.unlink()
                path.symlink_to(original.name)


def needed(library: Path) -> set[str]:
    """Names of the shared libraries that one asks for."""
    listing = subprocess.run(
        ["readelf", "--dynamic", str(library)], capture_output=True, encoding="utf-8", check=True
    ).stdout
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", listing))


def remove_unreached(folder: Path, roots: set[Path]) -> None:
    """Remove a folder's libraries that no root needs, directly or through another."""
    reached, todo = set[Path](), {path.resolve() for path in roots}
    while todo:
        path = todo.pop()
        reached.add(path)
        todo |= {
            (folder / name).resolve() for name in needed(path) if (folder / name).exists()
        } - reached
    for path in folder.glob("*.so*"):
        if path.resolve() not in reached:
            path.unlink()


def main() -> None:
    """Slim the environment and tell what it weighed before and after."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("environment", type=Path)
    (packages,) = parser.parse_args().environment.glob("lib/python*/site-packages")
    before = size(packages)
    remove_build_files(packages)
    casadi, cmeel = packages / "casadi", packages / "cmeel.prefix" / "lib"
    for kind in CASADI_KINDS:
        for path in casadi.glob(f"libcasadi_{kind}_*.so*"):
            if not any(path.name.startswith(f"libcasadi_{plugin}.so") for plugin in CASADI_PLUGINS):
                path.unlink()
    for folder in (casadi, cmeel):
        link_copies(folder)
    if shutil.which("readelf") and shutil.which("strip"):
        remove_unreached(casadi, {casadi / "_casadi.so", *casadi.glob("libcasadi_*.so")})
        remove_unreached(cmeel, set(cmeel.glob("python*/site-packages/*/*.so")))
        for library in (path for pattern in SYMBOLS for path in packages.glob(pattern)):
            # not in place: a process that runs has mapped the file, and would crash
            stripped = library.with_suffix(".stripped")
            subprocess.run(["strip", "--strip-unneeded", "-o", stripped, library], check=True)
            stripped.replace(library)
    print(f"{packages}: {before} MiB before, {size(packages)} MiB after")


if __name__ == "__main__":
    main()
