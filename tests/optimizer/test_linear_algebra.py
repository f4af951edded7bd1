"""The limit of one BLAS thread is in force in every thread that requests it, and ends when the last
one leaves.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from joulepath.optimizer.linear_algebra import one_thread

FREE = 3


@pytest.fixture(autouse=True)
def _several_blas_threads() -> Iterator[None]:
    with threadpool_limits(limits=FREE, user_api="blas"):
        yield


def counts() -> set[int]:
    """The numbers of threads of the BLAS libraries."""
    return {
        library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"
    }


class Neighbour:
    """Another thread that enters and leaves on request."""

    def __init__(self) -> None:
        self._entered, self._leave = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.seen: set[int] = set()
        self._thread.start()
        assert self._entered.wait(60)

    def _run(self) -> None:
        with one_thread():
            self.seen = counts()
            self._entered.set()
            assert self._leave.wait(60)

    def leave(self) -> None:
        self._leave.set()
        self._thread.join(60)


def test_contexts_may_be_nested() -> None:
    with one_thread():
        with one_thread():
            assert counts() == {1}
        assert counts() == {1}
    assert counts() == {FREE}


def test_a_thread_other_than_the_first_to_ask_is_limited() -> None:
    """The main thread was the first to set a number, and its limit is still in force."""
    neighbour = Neighbour()
    assert neighbour.seen == {1}
    neighbour.leave()
    assert counts() == {FREE}


@pytest.mark.parametrize("first", ["here", "there"])
def test_the_last_thread_to_leave_lifts_the_limit(first: str) -> None:
    with one_thread():
        neighbour = Neighbour()
        if first == "there":
            neighbour.leave()
            assert counts() == {1}
    if first == "here":
        assert counts() == {1}
        neighbour.leave()
    assert counts() == {FREE}


def test_the_first_to_come_may_leave_first() -> None:
    neighbour = Neighbour()
    with one_thread():
        neighbour.leave()
        assert counts() == {1}
    assert counts() == {FREE}


def test_an_error_lifts_the_limit_too() -> None:
    with pytest.raises(ZeroDivisionError), one_thread():
        raise ZeroDivisionError
    assert counts() == {FREE}
