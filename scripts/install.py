"""Installs a lockfile into the environment of the Python that runs this, and says how far it is.

Needs nothing but pip. Every package must have one of the hashes of the lockfile.
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
# Bytecode is made here, on all cores, where pip uses one. Not at the first import: a process that
# may write none would compile every library again, and where warnings are errors, one in a
# library's source would count as ours.
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
# so many lines of pip tell what went wrong
LAST = 20


def install(lockfile: Path) -> int:
    """Exit code of pip, with one line for every package that it takes."""
    count, seen = 0, list[str]()
    process = subprocess.Popen(
        [*PIP, "-r", str(lockfile)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )
    assert process.stdout is not None
    for line in process.stdout:
        seen = [*seen[1 - LAST :], line]
        if found := re.match(r"Collecting ([\w.\[\]-]+)==([\w.]+)", line):
            count += 1
            print(f"  {count:3d}  {found[1]} {found[2]}", flush=True)
        elif line.startswith("Installing collected packages"):
            print(f"  unpacking {count} packages ...", flush=True)
    code = process.wait()
    if code:
        print("".join(seen), file=sys.stderr)
        return code
    # its exit code tells of files in no Python of ours, such as templates: those are never imported
    subprocess.run([*COMPILE, sysconfig.get_path("purelib")], check=False)
    return 0


def main() -> int:
    """Install and return pip's exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lockfile", type=Path)
    lockfile: Path = parser.parse_args().lockfile
    print(f"Installing {lockfile} into {sys.prefix} ...", flush=True)
    return install(lockfile)


if __name__ == "__main__":
    sys.exit(main())
