"""Builds the documentation site in `app/static/help`, which the service sends at `/help`, from the
Markdown pages in `docs`.

Zensical builds the site. mkdocstrings writes the pages on the functions of the library from their
docstrings, without importing the library. If this environment lacks these tools, they are installed
into a separate environment, with the versions and digests of `requirements-docs.lock`.

This script is run by `make docs`, and by the build of the wheel and of the source archive
(`build_hook.py`). The site contains the digest of its sources, and is rebuilt when they have
changed.
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
DIGEST = "sources.txt"
"""File of the site with the digest of its sources."""
STYLE = "style.digest"
"""File of the site with the digest of the style sheet that its Content-Security-Policy allows."""
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
"""The only page of the site outside DOCS."""
LICENCES = """
from importlib.metadata import files
wanted = ("licenses/LICENSE.md", ".icons/lucide/LICENSE")
print(*(each.read_text() for each in files("zensical") if str(each).endswith(wanted)), sep="\\n\\n")
"""
"""Program that prints the licences of the theme and of its icons, for the site."""
FILES = Path("files")
"""Folder of the site for other files of the repository, as targets of links."""
_LINK = re.compile(r"(\]\()([^)\s#]+)([^)\s]*\))")
_PUBLIC = re.compile(r"^from (\.[\w.]+) import", re.M)


class BuildFailed(Exception):
    """The site cannot be built; the message has cause and remedy."""


def main() -> None:
    """Builds the site."""
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
    """Builds the site, and replaces the old one only if the build succeeds. Raises BuildFailed."""
    python = sys.executable if has_tools() else _own_tools()
    ENVIRONMENT.parent.mkdir(exist_ok=True)
    # The folder is outside the package, because it contains links to the package: inside, a search
    # for sources would never end.
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
    """The digest of all sources of the site. Raises OSError."""
    found = hashlib.sha256()
    for path in sorted(sources()):
        found.update(f"{path.relative_to(ROOT)}\0".encode())
        found.update(path.read_bytes())
    return found.hexdigest()


def sources() -> set[Path]:
    """All source files of the site. Raises OSError."""
    return {*_pages(), *_linked(), *_documented(), CONFIG, LOCK}


def _stage(folder: Path) -> None:
    """Copies pages, linked files and Python files into a folder in the layout of Zensical."""
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
    """The path of a file of the repository in the folder of pages."""
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS)
    if path == CONTRIBUTING:
        return Path("contributing.md")
    place = FILES / path.relative_to(ROOT)
    # the suffix keeps Zensical from turning Markdown into pages, and Python files into modules
    return place.with_name(f"{path.name}.text") if path.suffix in (".md", ".py") else place


def _with_links(page: Path) -> str:
    """The text of a page with links to the places of the linked files in the site."""

    def moved(link: re.Match[str]) -> str:
        target = _target(page, link[2])
        if target is None:
            return link[0]
        place = os.path.relpath(_place(target), _place(page).parent)
        return f"{link[1]}{place}{link[3]}"

    return _LINK.sub(moved, page.read_text(encoding="utf-8"))


def _target(page: Path, link: str) -> Path | None:
    """The file of the repository to which a link leads; None for other links."""
    if re.match(r"[a-z]+:|/", link):
        return None
    found = (page.parent / link).resolve()
    return found if found.is_file() and found.is_relative_to(ROOT) else None


def _style_of_search(site: Path) -> str:
    """The digest of the style sheet which the search script adds to its results, in the form of a
    Content-Security-Policy. Raises BuildFailed.
    """
    (script,) = site.glob("assets/javascripts/bundle.*.min.js")
    text = script.read_text(encoding="utf-8")
    used = re.search(r'"style",\{\},(\w+)\.toString\(\)', text)
    held = used and re.search(rf"\b{used[1]}='([^'\\]*)'", text)
    if not held:
        raise BuildFailed(
            "The style sheet of the search is not in the script of this version of Zensical: adapt "
            "`_style_of_search` in scripts/build_docs.py."
        )
    digest = hashlib.sha256(held[1].encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"


def _pages() -> Iterator[Path]:
    yield from (path for path in DOCS.rglob("*") if path.is_file())
    yield CONTRIBUTING


def _linked() -> Iterator[Path]:
    """Files outside the folder of pages that are targets of links on pages."""
    for page in _pages():
        if page.suffix == ".md":
            for link in _LINK.findall(page.read_text(encoding="utf-8")):
                found = _target(page, link[1])
                if found is not None and not found.is_relative_to(DOCS) and found != CONTRIBUTING:
                    yield found


def _documented() -> Iterator[Path]:
    """The Python files of the public names; their docstrings become pages."""
    stub = ROOT / "joulepath" / "__init__.pyi"
    yield stub
    for module in _PUBLIC.findall(stub.read_text(encoding="utf-8")):
        yield ROOT / "joulepath" / f"{module.lstrip('.').replace('.', '/')}.py"


def _own_tools() -> str:
    """The Python of a separate environment with the tools, which is created if necessary. Raises
    BuildFailed."""
    python, mark = ENVIRONMENT / "bin" / "python", ENVIRONMENT / "installed.lock"
    if mark.is_file() and mark.read_bytes() == LOCK.read_bytes():
        return str(python)
    print("Installing the tools for the pages ...", flush=True)
    venv.create(ENVIRONMENT, with_pip=False, clear=True)
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    options = ["--disable-pip-version-check", "--require-hashes", "--no-deps", "-r", str(LOCK)]
    try:
        subprocess.run([*pip, *options], check=True, stderr=subprocess.PIPE, encoding="utf-8")
    except (OSError, subprocess.CalledProcessError) as error:
        shutil.rmtree(ENVIRONMENT, ignore_errors=True)
        cause = getattr(error, "stderr", None) or error
        raise BuildFailed(
            f"The pages cannot be built without Zensical: {str(cause).strip()}\n"
            f"Give this machine access to PyPI, or copy {SITE} from a machine that has it."
        ) from None
    shutil.copy(LOCK, mark)
    return str(python)


def _plain(text: str) -> str:
    """The output of a program without colours."""
    return re.sub(r"\x1b\[[0-9;]*m", "", text).strip()


if __name__ == "__main__":
    main()
