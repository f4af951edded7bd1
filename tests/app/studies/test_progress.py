"""Changes from step to step, by hand."""

from __future__ import annotations

from joulepath.app.studies.answers import Progress, progress

ENERGIES = [100.0, 80.0, 90.0, 60.0, 60.0]
THRESHOLD = 80.0


def test_changes() -> None:
    assert progress(ENERGIES, THRESHOLD) == [
        Progress(None, None, False),
        Progress(-20.0, -20.0, True),
        Progress(10.0, 10.0, False),
        Progress(-30.0, -20.0, True),
        Progress(0.0, 0.0, True),
    ]


def test_a_change_from_the_best_is_from_the_best_before() -> None:
    assert [step.change_from_best for step in progress([50.0, 70.0, 65.0], 1.0)] == [
        None,
        20.0,
        15.0,
    ]


def test_nothing_yet() -> None:
    assert progress([], 1.0) == []
