"""Progress of a search and its bar in a terminal: it changes no result, only increases, and ends
with the answer.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from joulepath import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Problem,
    optimize,
    pareto,
    plan_cycle,
)
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import Event, no_listener, only_news
from joulepath.optimizer.search.candidates import Reason
from tests.optimizer.cycle.cycles import pick_and_place
from tests.optimizer.moves import GOAL, HOME, problem, tcp_pose
from tests.selection import long_but
from tests.terminal import on_terminal

SAME = 1e-12


def asked(bound: str) -> Problem:
    return problem(HOME, tcp_pose(GOAL), method="time_scaling", bound=bound)


def goes_forward(events: list[Event]) -> list[Improved]:
    """The best answers reported; every one is better than the one before, or has a better bound."""
    assert isinstance(events[0], CandidatesFound)
    totals = [each.total for each in events if isinstance(each, CandidatesFound)]
    assert totals == sorted(set(totals))
    tried = [each.index for each in events if isinstance(each, CandidateTried)]
    assert len(set(tried)) == len(tried) and max(tried) < totals[-1]
    best = [each for each in events if isinstance(each, Improved)]
    for before, after in pairwise(best):
        bounds = [-np.inf if each.bound is None else each.bound for each in (before, after)]
        assert after.energy <= before.energy and bounds[0] <= bounds[1]
        assert after.energy < before.energy or bounds[0] < bounds[1]
    assert all(pickle.loads(pickle.dumps(each)) is not None for each in events), (
        "they go through a pipe"
    )
    return best


@pytest.mark.parametrize("bound", long_but(["normal"], ["normal", "tight"]))
def test_a_search_ends_with_its_answer(bound: str) -> None:
    events: list[Event] = []
    answer = optimize(asked(bound), tell=events.append)
    unheard = optimize(asked(bound))
    assert (
        answer.trajectory.q == unheard.trajectory.q
    ).all() and answer.lower_bound == unheard.lower_bound
    last = goes_forward(events)[-1]
    assert (last.energy, last.duration) == (answer.energy.electrical.total, answer.duration)
    assert last.bound == answer.lower_bound
    assert last.q_goal is not None and (last.q_goal == answer.goal.q).all()
    assert events[0] == CandidatesFound(len(answer.candidates))
    told = {each.index: each for each in events if isinstance(each, CandidateTried)}
    assert set(told) == {
        k for k, each in enumerate(answer.candidates) if each.reason != Reason.BOUND.value
    }
    for index, each in told.items():
        assert each.status == answer.candidates[index].status.value


def test_no_bound_is_told_that_is_not_proven() -> None:
    """An orientation free about an axis is solved by samples: the bound follows at the end."""
    events: list[Event] = []
    start, goal = np.radians([0, -80, 90, -90, -85, 0]), np.radians([30, -70, 80, -90, -85, 10])
    answer = optimize(problem(start, tcp_pose(goal), method="time_scaling"), tell=events.append)
    for each in goes_forward(events):
        assert each.bound is None or each.bound <= answer.lower_bound


def test_a_cycle_ends_with_its_answer() -> None:
    events: list[Event] = []
    found = plan_cycle(pick_and_place(1, 2, method="time_scaling"), tell=events.append)
    last = goes_forward(events)[-1]
    assert last.energy == pytest.approx(sum(each.energy for each in found.moves), rel=SAME)
    assert (
        last.duration == pytest.approx(found.duration, rel=SAME) and last.bound == found.lower_bound
    )


def test_a_front_tells_its_durations() -> None:
    events: list[Event] = []
    front = pareto(problem(HOME, GOAL, method="time_scaling"), 4, tell=events.append)
    best = goes_forward(events)
    assert events[0] == CandidatesFound(4)
    assert best[-1].energy == pytest.approx(front.points[-1].energy.electrical.total, rel=2e-3)
    assert best[-1].bound == pytest.approx(front.points[-1].lower_bound, rel=2e-3)


def test_what_is_no_news_is_not_passed_on() -> None:
    events: list[Event] = []
    tell = only_news(events.append)
    news: list[Event] = [
        CandidatesFound(5),
        CandidateTried(3, "solved", 1.0, 9.0),
        Improved(9.0, bound=1.0),
        CandidatesFound(7),
        CandidateTried(4, "failed", None, None),
        Improved(8.0, bound=2.0),
    ]
    for each in (*news, *news):
        tell(each)
    assert list(map(repr, events)) == list(map(repr, news))
    tell(Improved(8.5, bound=3.0))
    assert isinstance(events[-1], Improved)
    assert (events[-1].energy, events[-1].bound) == (8.0, 3.0), (
        "a bound on a worse motion holds for the best one"
    )
    tell(Improved(7.0))
    assert isinstance(events[-1], Improved)
    assert (events[-1].energy, events[-1].bound) == (7.0, 3.0)
    assert only_news(no_listener) is no_listener


ROOT = Path(__file__).parents[2]
SEARCH = """
import time
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved
with progress_bar("Searching", delay={delay}) as tell:
    tell(CandidatesFound(4))
    tell(CandidateTried(0, "solved", 50.0, 60.0))
    tell(Improved(60.0, 1.0, 50.0))
    time.sleep({lasts})
print("done")
"""
STEPS = """
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import Steps
import time
with progress_bar("Fitting", delay=0.0) as tell:
    steps = Steps("fits", {total}, tell)
    time.sleep(0.3)
    steps.add(12)
"""
TWO_SEARCHES = """
import threading, time
from joulepath.optimizer.presentation.progress_bar import progress_bar
def search():
    with progress_bar("Searching", delay={delay}):
        time.sleep({lasts})
threads = [threading.Thread(target=search) for _ in range(2)]
for each in threads:
    each.start()
for each in threads:
    each.join()
print("done")
"""


def shown(delay: float, lasts: float, script: str = SEARCH) -> str:
    """The terminal output of searches."""
    own = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "120"}
    command = [sys.executable, "-c", script.format(delay=delay, lasts=lasts)]
    return on_terminal(command, own)


def test_a_terminal_shows_energy_and_gap_and_no_trace_is_left() -> None:
    text = shown(delay=0.0, lasts=0.6)
    assert "Searching: 60 J, at most 20.0% above the least possible" in text
    assert text.endswith("done\n")


@pytest.mark.parametrize(
    ("total", "told"), [(66, "Fitting: 12 of 66 fits"), (None, "Fitting: 12 fits")]
)
def test_a_terminal_shows_the_steps_of_a_computation(total: int | None, told: str) -> None:
    script = STEPS.format(total=total)
    assert told in shown(delay=0.0, lasts=0.0, script=script.replace("{", "{{").replace("}", "}}"))


def test_a_short_search_shows_nothing() -> None:
    assert shown(delay=60.0, lasts=0.0) == "done\n"


def test_two_searches_at_once_leave_no_trace() -> None:
    text = shown(delay=0.0, lasts=0.6, script=TWO_SEARCHES)
    assert "Traceback" not in text and text.endswith("done\n")


def test_a_pipe_gets_nothing() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SEARCH.format(delay=0.0, lasts=0.3)],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("done\n", "")


def test_a_listener_or_the_flag_turns_it_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    heard: list[Event] = []
    with progress_bar("Searching", heard.append, delay=60.0) as tell:
        assert tell == heard.append
    with progress_bar("Searching", wanted=False, delay=60.0) as tell:
        assert tell is no_listener
    with progress_bar("Searching", delay=60.0) as tell:
        assert tell is not no_listener
