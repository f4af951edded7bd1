"""Errors as problem details, without a server: every type has an example, a schema and a row in the
documentation.
"""

from __future__ import annotations

import json
import pickle
from collections import Counter
from typing import get_args

import numpy as np

from joulepath.app.engine.result import json_document
from joulepath.app.exceptions.access import Unauthenticated, WrongKey
from joulepath.app.exceptions.base import InternalError, InvalidRequest
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.stored import PartsNeeded, StoreFault, StoreUnavailable, UnknownAnswer
from joulepath.app.http.problems import path_of, problem_of
from joulepath.app.schemas.examples.problems import example_of
from joulepath.optimizer.exceptions import (
    MOST_LISTED,
    DeclaredError,
    InvalidProblem,
    NoTrajectory,
    UnreachablePose,
)
from joulepath.optimizer.result.candidates import CandidateReport, CandidateStatus
from joulepath.optimizer.search.errors import CollidingBranch, StartInCollision
from tests.app.problems import checked

TYPES = types_of_error()


def sent(error: Exception) -> bytes:
    return json_document(problem_of(error, "the-id"))


def subclasses(kind: type[DeclaredError]) -> set[type[DeclaredError]]:
    return set(kind.__subclasses__()).union(*(subclasses(child) for child in kind.__subclasses__()))


def test_every_class_with_a_title_is_a_type() -> None:
    declared = {
        kind for kind in subclasses(DeclaredError) if kind.__module__.startswith("joulepath.")
    }
    assert {kind for kind in declared if "title" in vars(kind)} == set(TYPES)
    assert len({kind.slug() for kind in TYPES}) == len(TYPES)


def test_says_when_it_occurs_and_what_to_do() -> None:
    for kind in TYPES:
        texts = (kind.__doc__ or "", kind.remedy, str(example_of(kind)))
        assert all(text.rstrip().endswith(".") for text in texts)
        assert "__doc__" in vars(kind) and not kind.title.endswith(".")


def test_its_document_fits_its_schema() -> None:
    for kind in TYPES:
        error = example_of(kind)
        assert type(error) is kind
        content = checked(kind, sent(error))
        assert (content.type, content.detail, content.instance) == (
            path_of(kind),
            str(error),
            "the-id",
        )
        assert all(getattr(content, name) is not None for name in type(content).model_fields), (
            "an example shows all"
        )


def test_survives_pickling() -> None:
    for kind in TYPES:
        error = example_of(kind)
        copy = pickle.loads(pickle.dumps(error))
        assert type(copy) is kind and str(copy) == str(error)
        assert repr(vars(copy)) == repr(vars(error))
        assert copy != error and hash(error), "an exception is equal to itself only"


def test_a_class_without_a_title_belongs_to_the_type_of_its_base() -> None:
    for error, kind in ((WrongKey(), Unauthenticated), (PartsNeeded(["a"]), UnknownAnswer)):
        assert checked(kind, sent(error)).detail == str(error) != str(kind())


def test_an_invalid_problem_is_an_invalid_request() -> None:
    error = InvalidProblem("scene.obstacles.3.pose", "pose must lie within 100 m of the origin.")
    content = checked(InvalidRequest, sent(error))
    assert content.detail == str(error)
    assert content.errors[0].model_dump() == {
        "loc": ["body", "scene", "obstacles", 3, "pose"],
        "msg": str(error),
    }


def test_an_unforeseen_error_keeps_its_message_to_itself() -> None:
    assert checked(InternalError, sent(ZeroDivisionError("secret"))).detail == str(InternalError())


def test_every_fault_of_the_database_has_a_message() -> None:
    faults = get_args(StoreFault)
    assert len({str(StoreUnavailable(fault)) for fault in faults}) == len(faults)


def test_an_unknown_distance_is_null() -> None:
    assert (
        checked(
            UnreachablePose, sent(UnreachablePose("goal", None, "It is out of reach."))
        ).distance
        is None
    )


def test_the_most_telling_candidates_are_listed_and_all_are_counted() -> None:
    numbers = {
        CandidateStatus.PRUNED: 100,
        CandidateStatus.INFEASIBLE: 30,
        CandidateStatus.FAILED: 20,
    }
    reports = [
        CandidateReport(
            start="a",
            start_target=0,
            goal="b",
            goal_target=0,
            q_start=np.zeros(6),
            q_goal=np.ones(6),
            status=status,
            reason="",
            lower_bound=np.inf,
        )
        for status, number in numbers.items()
        for _ in range(number)
    ]
    content = json.loads(sent(NoTrajectory(reports)))
    listed = Counter(each["status"] for each in content["candidates"])
    assert listed == {"failed": 20, "infeasible": 30, "pruned": MOST_LISTED - 50}
    assert content["candidate_counts"] == {
        **{str(status): number for status, number in numbers.items()},
        "solved": 0,
        "unvisited": 0,
    }
    assert (
        content["candidates"][0]["q_goal"] == [1.0] * 6
        and content["candidates"][0]["lower_bound"] is None
    )


def test_the_configurations_that_collide_least_are_listed() -> None:
    depths = np.linspace(0.5, 0.1, 100)
    branches = [
        CollidingBranch("a", 0, np.zeros(6), ("table", str(depth)), depth) for depth in depths
    ]
    content = checked(StartInCollision, sent(StartInCollision("start", branches)))
    assert content.depth == 0.1 and content.pair == ["table", "0.1"]
    assert [each.depth for each in content.branches] == sorted(depths)[:MOST_LISTED]
    assert "each of 100" in content.detail
