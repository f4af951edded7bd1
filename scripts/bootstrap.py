"""Creates a virtual environment with pip by the standard library alone.

Debian's python3 lacks pip and ensurepip. If they are missing, the wheel of pip is downloaded from
the package index, with pip's own settings for index and certificates, and compared with the digest
below.
"""

from __future__ import annotations

import argparse
import configparser
import hashlib
import os
import re
import shutil
import ssl
import subprocess
import sys
import tempfile
import urllib.parse
import urllib.request
from pathlib import Path

PIP_WHEEL = "pip-26.3-py3-none-any.whl"
PIP_SHA256 = "f3b60b20ffaadd4415ed7957212a38ac63fa4c5fa375bd0f4a797777940fad13"
OLDEST_PYTHON, TOO_NEW_PYTHON = (3, 11), (3, 14)
"""The oldest version with all packages, and the first one without: OMPL and EAIK have no wheels."""


def pip_setting(name: str) -> str | None:
    """A setting of pip, from the environment or else from the configuration files of the user and
    of the machine.
    """
    from_environment = os.environ.get("PIP_" + name.upper().replace("-", "_"))
    if from_environment:
        return from_environment
    user = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    files = [
        os.environ.get("PIP_CONFIG_FILE"),
        user / "pip/pip.conf",
        Path.home() / ".pip/pip.conf",
        "/etc/pip.conf",
    ]
    for file in filter(None, files):
        parser = configparser.RawConfigParser()
        parser.read(str(file))
        if parser.has_option("global", name):
            return parser.get("global", name)
    return None


def read(url: str) -> bytes:
    """The content of a URL; credentials in the URL are sent as basic authentication."""
    parts = urllib.parse.urlsplit(url)
    handlers: list[urllib.request.BaseHandler] = [
        urllib.request.HTTPSHandler(context=ssl.create_default_context(cafile=pip_setting("cert")))
    ]
    if parts.username:
        passwords = urllib.request.HTTPPasswordMgrWithPriorAuth()
        user, password = (
            urllib.parse.unquote(part or "") for part in (parts.username, parts.password)
        )
        parts = parts._replace(netloc=parts.netloc.rpartition("@")[2])
        passwords.add_password(None, parts.geturl(), user, password, is_authenticated=True)
        handlers.append(urllib.request.HTTPBasicAuthHandler(passwords))
    with urllib.request.build_opener(*handlers).open(parts.geturl(), timeout=60) as answer:
        content: bytes = answer.read()
    return content


def fetch_pip(folder: Path) -> Path:
    """Downloads the pinned wheel of pip into a folder. Raises ValueError if the index does not have
    exactly this file.
    """
    index = (pip_setting("index-url") or "https://pypi.org/simple").rstrip("/") + "/pip/"
    page = read(index).decode()
    link = re.search(r'href="([^"]*/)?' + re.escape(PIP_WHEEL) + r'[^"]*"', page)
    if link is None:
        raise ValueError(f"the package index does not list {PIP_WHEEL}")
    target = link.group(0)[len('href="') : -1].replace("&amp;", "&")
    wheel = read(urllib.parse.urljoin(index, target).partition("#")[0])
    if hashlib.sha256(wheel).hexdigest() != PIP_SHA256:
        raise ValueError(f"{PIP_WHEEL} from the package index does not have the pinned digest")
    path = folder / PIP_WHEEL
    path.write_bytes(wheel)
    return path


def create(environment: Path) -> None:
    """Creates the environment with pip, and replaces an existing one."""
    shutil.rmtree(environment, ignore_errors=True)
    venv = [sys.executable, "-m", "venv"]
    if subprocess.run([*venv, str(environment)], capture_output=True, check=False).returncode == 0:
        return
    subprocess.run([*venv, "--clear", "--without-pip", str(environment)], check=True)
    with tempfile.TemporaryDirectory() as folder:
        wheel = fetch_pip(Path(folder))
        python = environment / "bin" / "python"
        run = [str(python), f"{wheel}/pip", "install", "--quiet", "--no-index", str(wheel)]
        subprocess.run(run, check=True)


def main() -> int:
    """Creates the environment, or prints the cause and the remedy of a failure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("environment", type=Path)
    environment: Path = parser.parse_args().environment
    if not OLDEST_PYTHON <= sys.version_info < TOO_NEW_PYTHON:
        print(
            f"Not all packages exist for Python {sys.version.split()[0]}: install Python 3.11, "
            "3.12 or 3.13, and name it, as in: make PYTHON=python3.13",
            file=sys.stderr,
        )
        return 1
    try:
        create(environment)
    except (OSError, ValueError, subprocess.CalledProcessError) as error:
        shutil.rmtree(environment, ignore_errors=True)
        print(
            f"No virtual environment could be made ({error}): install python3-venv and try again.",
            file=sys.stderr,
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
