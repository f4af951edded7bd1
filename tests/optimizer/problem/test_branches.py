"""Which labels a branch filter allows, also those of arms that have other parts than shoulder,
elbow and wrist.
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.problem.branches import BranchFilter, Label

LABELS = [
    Label("left", "up", "flip"),
    Label("left", "up", "no_flip"),
    Label("left", "down", "flip"),
    Label("left", "down", "no_flip"),
    Label("right", "up", "flip"),
    Label("right", "up", "no_flip"),
    Label("right", "down", "flip"),
    Label("right", "down", "no_flip"),
]


@dataclass(frozen=True)
class ElbowOnly:
    """The label of an arm whose branches differ in the elbow alone."""

    elbow: str


def test_an_empty_filter_allows_every_label() -> None:
    assert all(
        BranchFilter().allows(label) for label in [*LABELS, ElbowOnly("up"), "another family's"]
    )


def test_each_part_that_is_named_halves_the_labels() -> None:
    assert sum(BranchFilter(elbow="up").allows(label) for label in LABELS) == 4
    assert sum(BranchFilter(elbow="up", wrist="flip").allows(label) for label in LABELS) == 2
    assert [label for label in LABELS if BranchFilter("left", "down", "no_flip").allows(label)] == [
        Label("left", "down", "no_flip")
    ]


def test_a_filter_assumes_only_the_parts_that_it_names() -> None:
    assert BranchFilter(elbow="up").allows(ElbowOnly("up"))
    assert not BranchFilter(elbow="down").allows(ElbowOnly("up"))
    # an arm without a shoulder part cannot be on the left
    assert not BranchFilter(shoulder="left").allows(ElbowOnly("up"))
