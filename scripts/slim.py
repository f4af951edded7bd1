"""Makes an environment smaller: removes files that only builds and tests need, and replaces copies
by links.

Wheels of C++ libraries contain headers, build files and static libraries. They also contain every
shared library under two or three names, because a wheel cannot contain links. If binutils are
installed, unused libraries and symbol tables are removed as well.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import shutil
import subprocess
from pathlib import Path

# Folders in site-packages that are not used at run time.
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
    # tests and viewer of MuJoCo, and its batches of simulations
    "mujoco/*_test.py",
    "mujoco/_batch.*",
    "mujoco/_render_filament.*",
    "mujoco/_rollout.*",
    "mujoco/_simulate.*",
]
# CasADi has many large plugins of these kinds, and loads them by name. Only CASADI_PLUGINS stay.
CASADI_KINDS = ["archiver", "conic", "graphmodel", "modelicaparser", "nlpsol", "onnx"]
CASADI_PLUGINS = [
    "conic_daqp",
    "conic_qpoases",
    "conic_qrqp",
    "nlpsol_ipopt",
    "nlpsol_qrsqp",
    "nlpsol_sqpmethod",
]
# Libraries with symbol tables of megabytes. Other libraries are not stripped, because this breaks
# libraries that tools for wheels have relocated.
SYMBOLS = [
    "cmeel.prefix/lib/libeigenpy.so",
    "cmeel.prefix/lib/python*/site-packages/*/*_pywrap*.so",
    "uvloop/*.so",
]


def size(folder: Path) -> int:
    """Disk space of the regular files in a folder [MiB]."""
    return (
        sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and not p.is_symlink()) >> 20
    )


def remove_build_files(packages: Path) -> None:
    """Removes headers, build files, static libraries and tests."""
    doomed = [packages / folder for folder in BUILD_FOLDERS]
    doomed += [path for pattern in BUILD_FILES for path in packages.glob(pattern)]
    for path in doomed:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def link_copies(folder: Path) -> None:
    """Replaces libraries with equal content by links."""
    first: dict[str, Path] = {}
    for path in sorted(folder.glob("*.so*")):
        if not path.is_symlink():
            original = first.setdefault(hashlib.sha256(path.read_bytes()).hexdigest(), path)
            if original != path:
                path.unlink()
                path.symlink_to(original.name)


def needed(library: Path) -> set[str]:
    """Names of the shared libraries that a library needs."""
    listing = subprocess.run(
        ["readelf", "--dynamic", str(library)], capture_output=True, encoding="utf-8", check=True
    ).stdout
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", listing))


def remove_unreached(folder: Path, roots: set[Path]) -> None:
    """Removes the libraries of a folder that no root needs directly or indirectly."""
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
    """Makes the environment smaller, and prints its size before and after."""
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
            # not in place, because a running process that has mapped the file would crash
            stripped = library.with_suffix(".stripped")
            subprocess.run(["strip", "--strip-unneeded", "-o", stripped, library], check=True)
            stripped.replace(library)
    print(f"{packages}: {before} MiB before, {size(packages)} MiB after")


if __name__ == "__main__":
    main()
