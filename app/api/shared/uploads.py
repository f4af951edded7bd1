"""Files of received bodies, which workers read. They have no name, so that nothing is left of them,
however the service ends."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from tempfile import TemporaryFile
from typing import BinaryIO

from fastapi import Request


@contextmanager
def upload() -> Iterator[tuple[BinaryIO, str]]:
    """A file to write a body to, unbuffered, and the path by which a worker can open it until the
    context ends.
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
