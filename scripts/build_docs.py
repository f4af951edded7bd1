"""Builds the site of the pages: `docs`, in Markdown, becomes `app/static/help`, which the service
sends at `/help`.

Zensical writes the site, and mkdocstrings the pages of the library's functions from its docstrings,
without importing it. Both are those of this environment; where there are none, those of an
environment of its own, in the versions and digests of `requirements-docs.lock`.

`make docs` runs it, and so does the build of the wheel and of the source archive (`build_hook.py`).
The site knows the digest of its sources: it is built anew when they have changed.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import importlib.util
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
DOCS = ROOT / "docs"
CONFIG = ROOT / "zensical.toml"
SITE = ROOT / "joulepath" / "app" / "static" / "help"
ENVIRONMENT = ROOT / "build" / "docs"
LOCK = ROOT / "requirements-docs.lock"
DIGEST = "sources.txt"  # beside the site: the digest of what it was built from
STYLE = "style.digest"  # beside the site: what its Content-Security-Policy allows
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
"""A page of the site that has its place elsewhere."""
LICENCES = """
from importlib.metadata import files
wanted = ("licenses/LICENSE.md", ".icons/lucide/LICENSE")
print(*(each.read_text() for each in files("zensical") if str(each).endswith(wanted)), sep="\\n\\n")
"""
"""Program that prints the licences of the theme and of its icons, which the site carries."""
FILES = Path("files")
"""Folder of the site for files of the repository that pages link to."""
_LINK = re.compile(r"(\]\()([^)\s#]+)([^)\s]*\))")
_PUBLIC = re.compile(r"^from (\.[\w.]+) import", re.M)


class BuildFailed(Exception):
    """The site cannot be built; the message says why, and what to do."""


def main() -> None:
    """Build the site."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--if-changed", action="store_true", help="only if its sources changed")
    if parser.parse_args().if_changed and is_current():
        return
    try:
        build()
    except BuildFailed as error:
        sys.exit(str(error))


def build(site: Path = SITE) -> None:
    """Build the site, whole or not at all. Raises BuildFailed."""
    python = sys.executable if has_tools() else _own_tools()
    ENVIRONMENT.parent.mkdir(exist_ok=True)
    # Outside the package: a search for sources would follow the links to it for ever.
    with tempfile.TemporaryDirectory(dir=ENVIRONMENT.parent, prefix="help-") as folder:
        stage = Path(folder)
        _stage(stage)
        command = [python, "-m", "zensical", "build", "--strict"]
        done = subprocess.run(
            command,
            cwd=stage,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            check=False,
        )
        new = stage / "site"
        if done.returncode != 0 or not (new / "index.html").is_file():
            raise BuildFailed(f"The pages cannot be built: {_plain(done.stdout)}")
        for unused in ("404.html", "sitemap.xml", "objects.inv"):
            (new / unused).unlink(missing_ok=True)
        licences = subprocess.check_output([python, "-c", LICENCES], encoding="utf-8")
        (new / "licences.txt").write_text(licences, encoding="utf-8")
        (new / STYLE).write_text(_style_of_search(new), encoding="utf-8")
        (new / DIGEST).write_text(digest(), encoding="utf-8")
        shutil.rmtree(site, ignore_errors=True)
        site.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(new, site)


def is_current(site: Path = SITE) -> bool:
    """Whether the site was built from the present sources."""
    try:
        return (site / DIGEST).read_text(encoding="utf-8") == digest()
    except OSError:
        return False


def has_tools() -> bool:
    """Whether this environment can build the site."""
    return all(
        importlib.util.find_spec(name) is not None for name in ("zensical", "mkdocstrings_handlers")
    )


def digest() -> str:
    """The digest of everything that the site is built from. Raises OSError."""
    found = hashlib.sha256()
    for path in sorted(sources()):
        found.update(f"{path.relative_to(ROOT)}\0".encode())
        found.update(path.read_bytes())
    return found.hexdigest()


def sources() -> set[Path]:
    """Every file that the site is built from. Raises OSError."""
    return {*_pages(), *_linked(), *_documented(), CONFIG, LOCK}


def _stage(folder: Path) -> None:
    """Lay out the sources as Zensical wants them: pages, files that they link to, Python files."""
    shutil.copy(CONFIG, folder)
    for path in (*_pages(), *_linked()):
        target = folder / "docs" / _place(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.suffix == ".md":
            target.write_text(_with_links(path), encoding="utf-8")
        else:
            shutil.copy(path, target)
    for name in ("__init__.py", "__init__.pyi"):
        (folder / "joulepath").mkdir(exist_ok=True)
        shutil.copy(ROOT / "joulepath" / name, folder / "joulepath")
    for package in ("app", "models", "optimizer"):
        (folder / "joulepath" / package).symlink_to(ROOT / "joulepath" / package)


def _place(path: Path) -> Path:
    """Where a file of the repository is in the folder of pages."""
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS)
    if path == CONTRIBUTING:
        return Path("contributing.md")
    place = FILES / path.relative_to(ROOT)
    # for reading as they are: the first is no page of the site, the other no module of the package
    return place.with_name(f"{path.name}.text") if path.suffix in (".md", ".py") else place


def _with_links(page: Path) -> str:
    """A page whose links lead to where the other files are in the site."""

    def moved(link: re.Match[str]) -> str:
        target = _target(page, link[2])
        if target is None:
            return link[0]
        place = os.path.relpath(_place(target), _place(page).parent)
        return f"{link[1]}{place}{link[3]}"

    return _LINK.sub(moved, page.read_text(encoding="utf-8"))


def _target(page: Path, link: str) -> Path | None:
    """The file of the repository that a link leads to."""
    if re.match(r"[a-z]+:|/", link):
        return None
    found = (page.parent / link).resolve()
    return found if found.is_file() and found.is_relative_to(ROOT) else None


def _style_of_search(site: Path) -> str:
    """The digest of the style sheet that the script of the search adds to its results, as a
    Content-Security-Policy names it. Raises BuildFailed.
    """
    (script,) = site.glob("assets/javascripts/bundle.*.min.js")
    text = script.read_text(encoding="utf-8")
    used = re.search(r'"style",\{\},(\w+)\.toString\(\)', text)
    held = used and re.search(rf"\b{used[1]}='([^'\\]*)'", text)
    if not held:
        raise BuildFailed("The style sheet of the search is not where it was: see this function.")
    digest = hashlib.sha256(held[1].encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"


def _pages() -> Iterator[Path]:
    yield from (path for path in DOCS.rglob("*") if path.is_file())
    yield CONTRIBUTING


def _linked() -> Iterator[Path]:
    """Files outside the folder of pages that a page links to."""
    for page in _pages():
        if page.suffix == ".md":
            for link in _LINK.findall(page.read_text(encoding="utf-8")):
                found = _target(page, link[1])
                if found is not None and not found.is_relative_to(DOCS) and found != CONTRIBUTING:
                    yield found


def _documented() -> Iterator[Path]:
    """The Python files of the public names, whose docstrings are pages."""
    stub = ROOT / "joulepath" / "__init__.pyi"
    yield stub
    for module in _PUBLIC.findall(stub.read_text(encoding="utf-8")):
        yield ROOT / "joulepath" / f"{module.lstrip('.').replace('.', '/')}.py"


def _own_tools() -> str:
    """The Python of an environment that can build the site. Raises BuildFailed."""
    python, mark = ENVIRONMENT / "bin" / "python", ENVIRONMENT / "installed.lock"
    if mark.is_file() and mark.read_bytes() == LOCK.read_bytes():
        return str(python)
    print("Fetching what builds the pages ...", flush=True)
    venv.create(ENVIRONMENT, with_pip=False, clear=True)
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    options = ["--disable-pip-version-check", "--require-hashes", "--no-deps", "-r", str(LOCK)]
    try:
        subprocess.run([*pip, *options], check=True, stderr=subprocess.PIPE, encoding="utf-8")
    except (OSError, subprocess.CalledProcessError) as error:
        shutil.rmtree(ENVIRONMENT, ignore_errors=True)
        told = getattr(error, "stderr", None) or error
        raise BuildFailed(
            f"The pages cannot be built without Zensical: {str(told).strip()}\n"
            f"Give this machine access to PyPI, or copy {SITE} from a machine that has it."
        ) from None
    shutil.copy(LOCK, mark)
    return str(python)


def _plain(text: str) -> str:
    """What a program told, without colours."""
    return re.sub(r"\x1b\[[0-9;]*m", "", text).strip()


if __name__ == "__main__":
    main()
