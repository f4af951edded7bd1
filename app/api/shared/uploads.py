"""Temporary files with received bodies, for workers.

The files have no name in the file system: no file remains, even if the service is killed.
"""

from __future__ import annotations

import logging
import os
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from tempfile import TemporaryFile
from typing import BinaryIO

from fastapi import Request

from joulepath.app.exceptions.transport import UploadNotStored

logger = logging.getLogger(__name__)


@contextmanager
def upload() -> Iterator[tuple[BinaryIO, str]]:
    """A context with an unbuffered file for a body, and its path for a worker.

    The path is valid until the context ends. Raises UploadNotStored.
    """
    with ExitStack() as stack:
        try:
            file = stack.enter_context(TemporaryFile(prefix="joulepath-", buffering=0))
        except OSError as error:
            raise _not_stored(error) from None
        yield file, f"/proc/{os.getpid()}/fd/{file.fileno()}"


def write(file: BinaryIO, body: bytes) -> None:
    """Writes a part of a body to an unbuffered file, as a whole. Raises UploadNotStored."""
    left = memoryview(body)
    try:
        while left:  # a disk that becomes full takes a part
            left = left[file.write(left) :]
    except OSError as error:
        raise _not_stored(error) from None


@asynccontextmanager
async def received(request: Request) -> AsyncIterator[tuple[BinaryIO, str]]:
    """An `upload` with the body of a request. Raises UploadNotStored."""
    with upload() as (file, path):
        async for chunk in request.stream():
            write(file, chunk)
        yield file, path


def _not_stored(error: OSError) -> UploadNotStored:
    logger.error("upload not stored", extra={"reason": str(error)})
    return UploadNotStored()
