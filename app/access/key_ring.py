"""The valid API keys: a change of their file applies from the next request on."""

from __future__ import annotations

import hmac
import logging
from pathlib import Path

from joulepath.app.access.key_file import ApiKey, WrongKeyFile, hash_of, read_keys

logger = logging.getLogger(__name__)

_Stamp = tuple[int, int, int, int]


class KeyRing:
    """The keys of a file. Raises WrongKeyFile at once if it cannot be read."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._stamp = _stamp(file)
        self._keys = read_keys(file)

    def find(self, secret: str) -> ApiKey | None:
        """The entry of a key; None if it is not valid."""
        self._refresh()
        found, digest = None, hash_of(secret)
        # All entries are compared in constant time: the time does not reveal the match.
        for key in self._keys:
            if hmac.compare_digest(key.sha256, digest):
                found = key
        return found

    def _refresh(self) -> None:
        """Reads a changed file. Without a file there are no keys; an invalid file changes
        nothing."""
        stamp = _stamp(self._file)
        if stamp == self._stamp:
            return
        self._stamp = stamp
        try:
            self._keys = [] if stamp is None else read_keys(self._file)
        except WrongKeyFile as error:
            logger.error("the previous API keys stay valid", extra={"reason": str(error)})
        else:
            logger.info("API keys read", extra={"keys": len(self._keys)})


def _stamp(file: Path) -> _Stamp | None:
    """A value changing with the content of the file; None without a file."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
