"""Temporary files with received bodies, for workers.

The files have no name in the file system: no file remains, even if the service is killed.
"""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from tempfile import TemporaryFile
from typing import BinaryIO

from fastapi import Request


@contextmanager
def upload() -> Iterator[tuple[BinaryIO, str]]:
    """A context with an unbuffered file for a body, and its path for a worker.

    The path is valid until the context ends.
    """
    with TemporaryFile(prefix="joulepath-", buffering=0) as file:
        yield file, f"/proc/{os.getpid()}/fd/{file.fileno()}"


@asynccontextmanager
async def received(request: Request) -> AsyncIterator[tuple[BinaryIO, str]]:
    """An `upload` with the body of a request."""
    with upload() as (file, path):
        async for chunk in request.stream():
            file.write(chunk)
        yield file, path
