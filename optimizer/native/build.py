"""Compiles the C library that all arms share, beside its sources: `python
optimizer/native/build.py`.

`make` runs it in a clone, and `scripts/build_hook.py` for a wheel. It imports nothing but the
standard library, so that it runs where no dependency is installed.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
# Python takes a file whose name ends in .so for an extension module.
LIBRARY = FOLDER / "libjoulepath.so.1"
# Without contraction of products and sums, all processors round alike.
FLAGS = ["-O3", "-fPIC", "-shared", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off"]
# The oldest instruction set of an architecture, as gcc and clang name it, and zig. Compilers may
# default to a newer one.
BASELINES = {"x86_64": "-march=x86-64", "aarch64": "-march=armv8-a"}
ZIG_BASELINE = "-mcpu=baseline"


class BuildFailed(Exception):
    """The library cannot be compiled; the message says why, and what to do."""


def sources_digest(folder: Path = FOLDER) -> str:
    """Hash of all C files of a folder."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.c")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def compiler() -> str | None:
    """Path of the C compiler: the one that CC names, or the system's; None if there is none."""
    names = os.environ.get("CC", "cc"), "gcc", "clang"
    return next(filter(None, map(shutil.which, names)), None)


def build(folder: Path = FOLDER) -> Path:
    """Compile the C files of a folder into the library beside them.

    The library runs on every processor of this machine's architecture. Raises BuildFailed, and
    leaves an earlier library in place.
    """
    target = folder / LIBRARY.name
    define = f'-DSOURCES_DIGEST="{sources_digest(folder)}"'
    told: object = "there is neither a C compiler nor the package ziglang"
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".native-") as work:
            made = Path(work) / target.name
            given = [*FLAGS, define, str(folder / "library.c"), "-o", str(made), "-lm"]
            failed = []
            for command in _commands():
                done = subprocess.run(
                    [*command, *given], capture_output=True, text=True, encoding="utf-8"
                )
                if done.returncode == 0:
                    # whoever has loaded the one before keeps it
                    made.replace(target)
                    return target
                failed.append(done.stderr.strip())
            told = failed[0] if failed else told
    except OSError as error:
        told = error
    raise BuildFailed(
        f"The C library of the optimizer cannot be compiled: {told}\n"
        "Name a C compiler that works by CC, or install one, such as `ziglang` from PyPI."
    )


def _commands() -> list[list[str]]:
    """The compiler with what makes it compile for every processor of this machine's kind; the first
    that works counts.

    What CC names may be zig: where there is no C compiler, `make` installs it.
    """
    found, machine = compiler(), platform.machine()
    if found is not None:
        gcc = [found, BASELINES[machine]] if machine in BASELINES else [found]
        return [gcc, [found, ZIG_BASELINE]]
    if find_spec("ziglang") is not None:
        return [[sys.executable, "-m", "ziglang", "cc", ZIG_BASELINE]]
    return []


if __name__ == "__main__":
    try:
        print(build())
    except BuildFailed as failure:
        sys.exit(str(failure))
