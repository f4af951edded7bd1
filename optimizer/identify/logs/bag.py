"""Bags of ROS 2, `.db3` or `.mcap`, as the text of a log: their JointState messages."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import RawIOBase
from itertools import chain, islice
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, BinaryIO

import numpy as np

from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.errors import LogTooLarge

_MAGIC = {b"SQLite format 3\x00": ".db3", b"\x89MCAP0\r\n": ".mcap"}
JOINT_STATE = "sensor_msgs/msg/JointState"
_KINDS = ("position", "velocity", "effort")


@dataclass(frozen=True)
class BagSettings:
    """Settings of the reading of a bag."""

    head_messages: int = 1000
    """Messages among which the most frequent list of joints is that of the arm; grippers may
    publish theirs on the same topic."""
    copied_bytes: int = 1 << 20
    """Bytes that are unpacked at once."""


BAG = BagSettings()


def kind_of_bag(head: bytes) -> str | None:
    """Suffix of the files of this kind, by the first bytes of a file; None for no bag."""
    return next((kind for magic, kind in _MAGIC.items() if head.startswith(magic)), None)


def bag_text(file: BinaryIO, kind: str, max_bytes: int) -> PieceReader:
    """The JointState messages of a bag as a CSV file with names of joints.

    Args:
        file: the bag, unpacked.
        kind: suffix of the files of its kind.
        max_bytes: largest size of the bag [bytes].

    Returns:
        The CSV file. Its reading raises InvalidTable if the bag is broken or has no JointState
        messages, and LogTooLarge if it is too large.
    """
    lines = _lines(file, kind, max_bytes)
    return PieceReader(lambda size: next(lines, b""), lines.close)


def _lines(file: BinaryIO, kind: str, max_bytes: int) -> Generator[bytes]:
    """Lines of the CSV file."""
    with _on_disk(file, kind, max_bytes) as path:
        states = _states(path)
        head = [*islice(states, BAG.head_messages)]
        if not head:
            raise InvalidTable(
                f"The bag has no messages of the type {JOINT_STATE}: record the topic of the "
                "joint states, or export the log as CSV."
            )
        first, _ = Counter((tuple(each.name), _kinds(each)) for _, each in head).most_common(1)[0]
        names, kinds = first
        stamped = all(each.header.stamp.sec for _, each in head)
        yield (",".join(["time", *(f"{n}/{k}" for k in kinds for n in names)]) + "\n").encode()
        began: int | None = None
        for written, state in chain(head, states):
            if (tuple(state.name), _kinds(state)) != first:
                continue
            checkpoint()
            stamp = state.header.stamp
            time = stamp.sec * 1_000_000_000 + stamp.nanosec if stamped else written
            began = time if began is None else began
            values = np.concatenate([getattr(state, each) for each in kinds])
            cells = [f"{1e-9 * (time - began):.9f}", *map(repr, values.tolist())]
            yield (",".join(cells) + "\n").encode()


def _kinds(state: Any) -> tuple[str, ...]:
    """Kinds of values with one value per joint in a state."""
    return tuple(each for each in _KINDS if len(getattr(state, each)) == len(state.name) > 0)


def _states(path: Path) -> Iterator[tuple[int, Any]]:
    """Times of writing [ns] and JointState messages of the topic with the most messages."""
    # imported late: most logs are no bags
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    try:
        with Reader(path) as bag:
            topics = [each for each in bag.connections if each.msgtype == JOINT_STATE]
            if topics:
                most = max(topics, key=lambda each: each.msgcount)
                for _, written, raw in bag.messages([most]):
                    yield written, types.deserialize_cdr(raw, JOINT_STATE)
    # the library has no base class for its errors about broken files
    except Exception as error:
        raise InvalidTable(
            f"The bag cannot be read ({type(error).__name__}: {error}): record it again, or "
            "export the log as CSV."
        ) from None


@contextmanager
def _on_disk(file: BinaryIO, kind: str, max_bytes: int) -> Iterator[Path]:
    """The bag as a file on disk, because its reader needs a path."""
    with NamedTemporaryFile(suffix=kind) as copy:
        size = 0
        while part := file.read(BAG.copied_bytes):
            checkpoint()
            size += len(part)
            if size > max_bytes:
                raise LogTooLarge(max_bytes, "bytes after unpacking")
            copy.write(part)
        copy.flush()
        yield Path(os.fspath(copy.name))


class PieceReader(RawIOBase):
    """A readable binary file over a source of pieces.

    Args:
        next_piece: returns the next piece, of any size, for a requested number of bytes; returns
            an empty piece at the end of the file.
        close: closes the source of the pieces.
    """

    def __init__(
        self, next_piece: Callable[[int], bytes], close: Callable[[], object] | None = None
    ) -> None:
        self._next_piece, self._close = next_piece, close
        self._rest = b""

    def readable(self) -> bool:
        """Always true."""
        return True

    def readinto(self, buffer: Any, /) -> int:
        """Read into a buffer; raises the errors of the pieces."""
        view = memoryview(buffer)
        piece = self._rest or self._next_piece(len(view))
        count = min(len(view), len(piece))
        view[:count], self._rest = piece[:count], piece[count:]
        return count

    def close(self) -> None:
        """Close the file."""
        if self._close is not None:
            self._close()
        super().close()
