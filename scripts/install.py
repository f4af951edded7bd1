"""Installs a lockfile into the environment of the running Python, with progress messages.

The script only needs pip. Every package must have one of its hashes in the lockfile.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

PIP = [
    sys.executable,
    "-m",
    "pip",
    "install",
    "--disable-pip-version-check",
    "--require-hashes",
    "--no-deps",
]
PIP += ["--progress-bar", "off", "--no-compile"]
# Bytecode is compiled here on all cores, because pip uses one core. Without it, a process that may
# not write bytecode would compile all libraries at every start. Where warnings are errors, warnings
# of the compiler about libraries would also become errors.
COMPILE = [
    sys.executable,
    "-W",
    "ignore",
    "-m",
    "compileall",
    "-qq",
    "-j",
    "0",
    "-x",
    r"[/\\](tests|pip)[/\\]",
]
LAST = 20
"""Number of lines of pip that are printed after an error."""


def install(lockfile: Path) -> int:
    """Installs a lockfile, prints one line per package, and returns the exit code of pip."""
    count, last_lines = 0, list[str]()
    process = subprocess.Popen(
        [*PIP, "-r", str(lockfile)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )
    assert process.stdout is not None
    for line in process.stdout:
        last_lines = [*last_lines[1 - LAST :], line]
        if found := re.match(r"Collecting ([\w.\[\]-]+)==([\w.]+)", line):
            count += 1
            print(f"  {count:3d}  {found[1]} {found[2]}", flush=True)
        elif line.startswith("Installing collected packages"):
            print(f"  unpacking {count} packages ...", flush=True)
    code = process.wait()
    if code:
        print("".join(last_lines), file=sys.stderr)
        return code
    # the exit code is ignored: some files, such as templates, are not valid Python, and are never
    # imported
    subprocess.run([*COMPILE, sysconfig.get_path("purelib")], check=False)
    return 0


def main() -> int:
    """Installs the lockfile and returns the exit code of pip."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lockfile", type=Path)
    lockfile: Path = parser.parse_args().lockfile
    print(f"Installing {lockfile} into {sys.prefix} ...", flush=True)
    return install(lockfile)


if __name__ == "__main__":
    sys.exit(main())
