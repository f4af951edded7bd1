"""Who waits and who works."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from joulepath.app.engine.census import Census


def test_the_oldest_that_still_waits_counts() -> None:
    now = 100.0
    census = Census(clock=lambda: now)
    assert (census.waiting, census.oldest) == (0, 0.0)
    first, second = ExitStack(), ExitStack()
    first.enter_context(census.waits())
    now = 103.0
    second.enter_context(census.waits())
    now = 110.0
    assert (census.waiting, census.oldest) == (2, 10.0)
    first.close()
    assert (census.waiting, census.oldest) == (1, 7.0)
    second.close()
    assert (census.waiting, census.oldest) == (0, 0.0)


def test_what_fails_is_counted_out() -> None:
    census = Census()

    def fail() -> None:
        with census.waits(), census.works():
            assert (census.waiting, census.busy) == (1, 1)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert (census.waiting, census.busy) == (0, 0)
