"""Compiles the C library shared by all arms, beside its sources.

    python optimizer/native/build.py

`make` runs it in a clone, and `scripts/build_hook.py` for a wheel. It imports only the standard
library, so it needs no installed dependency.
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
# Options of gcc and clang, and of zig, for the oldest instruction set of an architecture. Compilers
# may default to a newer one.
BASELINES = {"x86_64": "-march=x86-64", "aarch64": "-march=armv8-a"}
ZIG_BASELINE = "-mcpu=baseline"


class BuildFailed(Exception):
    """The library cannot be compiled; the message says why, and how to solve it."""


def sources_digest(folder: Path = FOLDER) -> str:
    """Hash of all C files of a folder."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.c")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def compiler() -> str | None:
    """Path of the C compiler named by CC, or of the system's; None if there is none, or if CC is
    empty."""
    named = os.environ.get("CC", "cc")
    return next(filter(None, map(shutil.which, (named, "gcc", "clang"))), None) if named else None


def build(folder: Path = FOLDER) -> Path:
    """Compiles the C files of a folder into the library beside them.

    The library runs on every processor of this machine's architecture.

    Raises:
        BuildFailed: no compiler works; an earlier library stays in place.
    """
    target = folder / LIBRARY.name
    define = f'-DSOURCES_DIGEST="{sources_digest(folder)}"'
    cause: object = "there is neither a C compiler nor the package ziglang"
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".native-") as work:
            output = Path(work) / target.name
            arguments = [*FLAGS, define, str(folder / "library.c"), "-o", str(output), "-lm"]
            messages = []
            for command in _commands():
                process = subprocess.run(
                    [*command, *arguments],
                    capture_output=True,
                    text=True,
                    encoding="utf-8",
                    env=os.environ | {"TMPDIR": work},
                )
                if process.returncode == 0:
                    # Processes that have loaded the previous library keep it.
                    output.replace(target)
                    return target
                messages.append(process.stderr.strip())
            cause = messages[0] if messages else cause
    except OSError as error:
        cause = error
    raise BuildFailed(
        f"The C library of the optimizer cannot be compiled: {cause}\nSet CC to a C compiler "
        "that works, or install one, such as `ziglang` from PyPI."
    )


def _commands() -> list[list[str]]:
    """Compiler commands, each with the option for every processor of this architecture; the first
    command that works is used.

    CC may name zig: `make` installs it if there is no C compiler.
    """
    command, machine = compiler(), platform.machine()
    if command is not None:
        gcc = [command, BASELINES[machine]] if machine in BASELINES else [command]
        return [gcc, [command, ZIG_BASELINE]]
    if find_spec("ziglang") is not None:
        return [[sys.executable, "-m", "ziglang", "cc", ZIG_BASELINE]]
    return []


if __name__ == "__main__":
    try:
        print(build())
    except BuildFailed as failure:
        sys.exit(str(failure))
