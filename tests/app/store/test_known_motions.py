"""Motions of cells in SQLite and PostgreSQL: the last used are found; equal ones may be kept at
once.
"""

from __future__ import annotations

import asyncio
import threading
from functools import partial

from sqlalchemy.orm import Session

from joulepath.app.store import known_motions
from joulepath.app.store.store import Store
from tests.app.databases import on_both_databases

CELL = "c" * 64
OTHER = "d" * 64


async def keep(
    store: Store, cell: str, most: int = known_motions.KNOWN_MOTIONS.total, **motions: bytes
) -> None:
    await store.write(partial(known_motions.keep, cell=cell, motions=motions, most=most))


async def found(store: Store, cell: str) -> dict[str, bytes]:
    return await store.read(partial(known_motions.find, cell=cell))


async def test_each_cell_has_its_own_and_those_used_last_stay(store: Store) -> None:
    assert await found(store, CELL) == {}
    await keep(store, CELL, a=b"1", b=b"2")
    await keep(store, OTHER, a=b"3")
    assert await found(store, CELL) == {"a": b"1", "b": b"2"}
    assert await found(store, OTHER) == {"a": b"3"}
    await keep(store, CELL, b=b"other", c=b"4")
    assert list(await found(store, CELL)) == ["b", "c", "a"], "the last ones first"
    assert (await found(store, CELL))["b"] == b"2", "the same question has the same answer"
    await keep(store, OTHER, most=3, e=b"5")
    assert set(await found(store, CELL)) == {"b", "c"}
    assert await found(store, OTHER) == {"e": b"5"}


@on_both_databases
async def test_two_that_keep_the_same_at_the_same_time(url: str, store: Store) -> None:
    await keep(store, CELL, a=b"1")
    both = threading.Barrier(2, timeout=5)

    def keep_slowly(session: Session, keys: str) -> None:
        if not str(url).startswith("sqlite"):  # there, only one writes at a time
            both.wait()
        known_motions.keep(session, CELL, dict.fromkeys(keys, b"1"))

    await asyncio.gather(
        *(store.write(partial(keep_slowly, keys=keys)) for keys in ("abcdefgh", "hgfedcba"))
    )
    assert set(await found(store, CELL)) == set("abcdefgh")
