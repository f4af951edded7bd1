"""In any number of threads of one process, every result is bitwise equal to the result of one
thread."""

from __future__ import annotations

import itertools
import random
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from joulepath.optimizer.collision.planner import path_planner
from joulepath.optimizer.deadline import Deadline
from tests.optimizer.concurrent_work import Work, all_work, behind_a_post, fingerprint

THREADS = 8
# s: ample for a machine busy with other work; an idle one needs a tenth
PATIENCE = 1200.0


@pytest.fixture(autouse=True)
def _several_blas_threads() -> Iterator[None]:
    """Allows four BLAS threads, as a program may: results must not depend on their number."""
    with threadpool_limits(limits=4, user_api="blas"):
        yield


def in_threads(shares: Sequence[Sequence[Work]]) -> list[dict[str, object]]:
    """The fingerprint of every result by the work's name, for threads with a share of the work
    each, run at the same time.
    """
    found: list[dict[str, object]] = [{} for _ in shares]
    errors: list[BaseException] = []
    ready = threading.Barrier(len(shares))

    def work(own: dict[str, object], share: Sequence[Work]) -> None:
        try:
            ready.wait()
            for each in share:
                own[each.name] = fingerprint(each.run())
        except BaseException as error:
            errors.append(error)

    threads = [
        threading.Thread(target=work, args=each, daemon=True)
        for each in zip(found, shares, strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    if errors:
        raise errors[0]
    assert not any(thread.is_alive() for thread in threads), "a thread waits for another for ever"
    return found


def assert_as_alone(shares: Sequence[Sequence[Work]]) -> None:
    """First alone, then in threads."""
    works = {each.name: each for share in shares for each in share}
    alone = {name: fingerprint(each.run()) for name, each in works.items()}
    for own, share in zip(in_threads(shares), shares, strict=True):
        assert [each.name for each in share if own[each.name] != alone[each.name]] == []


def shuffled(works: Sequence[Work], seed: int) -> list[Work]:
    return random.Random(seed).sample(list(works), len(works))


@pytest.mark.long
@pytest.mark.timeout(2 * PATIENCE)
def test_eight_threads_give_what_one_gives_fifty_times_each() -> None:
    """Every thread does all the work, in an order of its own."""
    works = all_work()
    assert len(works) == 50
    assert_as_alone([shuffled(works, k) for k in range(THREADS)])


def test_a_thread_that_waits_for_another_ones_planner_keeps_its_deadline() -> None:
    """Here the other one never ends; the clock ticks by a second whenever it is read."""
    ticks = itertools.count()
    asked = behind_a_post()
    assert isinstance(asked.start, np.ndarray) and isinstance(asked.goal, np.ndarray)
    with path_planner._OMPL:
        late = Deadline(5.0, lambda: float(next(ticks)))
        assert path_planner.plan_paths(asked.arm, asked.start, asked.goal, late).paths == []
    assert next(ticks) > 5


def test_robots_are_loaded_once_by_threads_that_come_at_once() -> None:
    """In a new process, before any robot is loaded."""
    code = (
        "import threading\n"
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from joulepath.optimizer.problem.robots import load_robot\n"
        "together = threading.Barrier(8)\n"
        "with ThreadPoolExecutor(8) as executor:\n"
        "    loaded = list(executor.map(lambda _: together.wait() < 8 and load_robot('ur5e'), "
        "range(8)))\n"
        "print(len({id(robot) for robot in loaded}))\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE
    )
    assert (run.returncode, run.stdout.strip(), run.stderr) == (0, "1", "")
