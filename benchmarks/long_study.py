"""Time and memory to add an iteration to a study, by the number of iterations that it has.

    python -m benchmarks.long_study                 up to 20,000 iterations
    python -m benchmarks.long_study --most 5000

The iterations are written to the store of this process, without computing motions. After each block, the time of the
store's part of a `POST /studies/{id}/iterations` is measured: the study is read, the iteration added, its answer made.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import tempfile
import time
from functools import partial
from typing import Any

from benchmarks.service import resident
from joulepath.app.access.client import OPERATOR
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.store import studies
from joulepath.app.store.store import Store
from joulepath.app.store.studies import Step
from joulepath.app.store.tables import new_id
from joulepath.app.studies import answers

BLOCKS = (0, 100, 1000, 5000, 10_000, 20_000)
REPEATS = 20


def _step(k: int) -> Step:
    return Step("evaluate", {"k": k}, StoredAnswer(new_id(), b'{"k": 1}'), 1.0, 100.0 + 1.0 / (1 + k), 50.0)


async def _posted(store: Store, study_id: str, k: int) -> float:
    """Time [ms] of the store's part of one POST."""
    began = time.perf_counter()
    await store.read(partial(studies.state, study_id=study_id))
    number, _ = await store.write(partial(studies.add, study_id=study_id, step=_step(k), key=None, client=OPERATOR))
    answers.detail(await store.read(partial(studies.entry, study_id=study_id, number=number)))
    return 1e3 * (time.perf_counter() - began)


def _fill(session: Any, study_id: str, first: int, end: int) -> None:
    for k in range(first, end):
        studies.add(session, study_id, _step(k), None, OPERATOR)
        session.flush()
        session.expunge_all()


async def _run(most: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store = Store(f"sqlite:///{folder}/joulepath.db")
        study = studies.new_study("A long study", "ur5e", "electrical", 50.0, None, None)
        await store.write(partial(studies.create, study=study))
        count = 0
        print("iterations   p50 [ms]   max [ms]   memory [MiB]")
        for size in (size for size in BLOCKS if size <= most):
            while count < size:
                end = min(size, count + 500)
                await store.write(partial(_fill, study_id=study.id, first=count, end=end))
                count = end
            times = [await _posted(store, study.id, count + k) for k in range(REPEATS)]
            count += REPEATS
            memory = resident(os.getpid())
            print(f"{size:10}{statistics.median(times):11.1f}{max(times):11.1f}{memory:15.0f}", flush=True)
        await store.close()


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=20_000, help="iterations at most (%(default)s)")
    asyncio.run(_run(parser.parse_args().most))


if __name__ == "__main__":
    main()
