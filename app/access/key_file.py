"""The file of API keys: one entry per key, with its name, role and hash. No key can be read from
it.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Annotated

import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from joulepath.app.exceptions.access import Role


@dataclass(frozen=True)
class KeySettings:
    """Properties of API keys and of their file."""

    name_length: int = 64
    """Longest name of a key; the database stores it as owner."""
    secret_bytes: int = 32
    """Random bytes of a key: too many for a search, so that a fast hash without salt suffices."""
    id_length: int = 8
    """Characters of the id of a key."""
    mode: int = 0o600
    """Permissions of the file."""


KEYS = KeySettings()

_HEAD = (
    "# API keys of joulepath, written by `joulepath keys`. Only hashes: no key can be read "
    "from this file.\n"
)
_PREFIX = "joulepath_"
"""Prefix of every key, so that scanners of source code find committed keys."""


class WrongKeyFile(Exception):
    """The file of API keys is invalid; the message says why, and what to do."""


class ApiKey(BaseModel):
    """One key. Keys with the same name belong to the same client, so that keys can be rotated."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[
        str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=KEYS.name_length)
    ]
    role: Role
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    created: datetime

    @property
    def id(self) -> str:
        """The beginning of the hash: tells keys of one name apart."""
        return self.sha256[: KEYS.id_length]


_ENTRIES = TypeAdapter(list[ApiKey])


def hash_of(secret: str) -> str:
    """SHA-256 of a key, in hexadecimal digits."""
    return hashlib.sha256(secret.encode()).hexdigest()


def new_key(name: str, role: Role) -> tuple[str, ApiKey]:
    """A new random key and its entry. Raises ValidationError for an invalid name."""
    secret = _PREFIX + secrets.token_urlsafe(KEYS.secret_bytes)
    entry = ApiKey(
        name=name,
        role=role,
        sha256=hash_of(secret),
        created=datetime.now(UTC).replace(microsecond=0),
    )
    return secret, entry


def read_keys(file: Path) -> list[ApiKey]:
    """The entries of the file. Raises WrongKeyFile."""
    try:
        return _ENTRIES.validate_python(yaml.load(file.read_bytes(), yaml.CSafeLoader) or [])
    except OSError as error:
        raise WrongKeyFile(
            f"{file} cannot be read ({error.strerror}): name another file, or create it with "
            "`joulepath keys add`."
        ) from None
    except yaml.YAMLError as error:
        where = f", line {mark.line + 1}" if (mark := getattr(error, "problem_mark", None)) else ""
        raise WrongKeyFile(f"{file}{where} is not YAML: write it with `joulepath keys`.") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the document"
        raise WrongKeyFile(
            f"{file}: {where}: {first['msg']}: write it with `joulepath keys`."
        ) from None


@contextlib.contextmanager
def changing(file: Path) -> Iterator[list[ApiKey]]:
    """The entries, to be changed in place; they are on the disk when the context is left. Another
    change waits.

    Raises WrongKeyFile; OSError if the file cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    folder = os.open(file.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        entries = read_keys(file) if file.exists() else []
        yield entries
        _replace(file, entries)
        os.fsync(folder)
    finally:
        os.close(folder)


def _replace(file: Path, entries: Sequence[ApiKey]) -> None:
    """Replaces the file atomically for services reading it."""
    text = _HEAD + yaml.safe_dump(_ENTRIES.dump_python(list(entries)), sort_keys=False)
    with NamedTemporaryFile(
        "w", encoding="utf-8", dir=file.parent, prefix=f".{file.name}.", delete=False
    ) as new:
        try:
            new.write(text)
            new.flush()
            os.fsync(new.fileno())
            known = file.stat() if file.exists() else None
            os.fchmod(new.fileno(), KEYS.mode if known is None else known.st_mode & 0o777)
            if (
                known is not None and os.geteuid() == 0
            ):  # it stays readable to the user of the service
                os.fchown(new.fileno(), known.st_uid, known.st_gid)
            Path(new.name).replace(file)
        except BaseException:
            Path(new.name).unlink(missing_ok=True)
            raise
