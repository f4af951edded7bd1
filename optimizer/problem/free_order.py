"""A free order of the stops of a cycle, and its restrictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from joulepath.optimizer.exceptions import ContradictoryOrder, InvalidProblem
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.stops import Stop

MOST_FREE_STOPS = 12
"""Most stops of a cycle with a free order; the search visits all subsets of them."""


@dataclass(frozen=True, kw_only=True)
class FreeOrder:
    """Restrictions of a free order of stops.

    Attributes:
        before: pairs of stops; the first of a pair comes earlier than the second.
        together: lists of stops visited directly after one another, in this order.

    Raises:
        InvalidProblem: a field is no list of names.
    """

    before: Sequence[tuple[str, str]] = ()
    together: Sequence[Sequence[str]] = ()

    def __post_init__(self) -> None:
        check_fields(self)


def groups_of(order: FreeOrder, stops: Sequence[Stop]) -> list[list[Stop]]:
    """Groups of stops to be visited together, in the given order of their first stops."""
    by_name = {stop.name: stop for stop in stops}
    listed = {name: list(names) for names in order.together for name in names}
    groups = list[list[Stop]]()
    for stop in stops:
        names = listed.get(stop.name, [stop.name])
        if stop.name == names[0]:
            groups.append([by_name[name] for name in names])
    return groups


def earlier_groups(order: FreeOrder, groups: Sequence[Sequence[Stop]]) -> list[set[int]]:
    """Numbers of the groups before every group."""
    number = {stop.name: k for k, group in enumerate(groups) for stop in group}
    earlier = [set[int]() for _ in groups]
    for first, second in order.before:
        if number[first] != number[second]:
            earlier[number[second]].add(number[first])
    return earlier


def is_given_order_allowed(order: FreeOrder, stops: Sequence[Stop]) -> bool:
    """Whether the stops may be visited in the given order."""
    place = {stop.name: k for k, stop in enumerate(stops)}
    listed = all(place[b] == place[a] + 1 for names in order.together for a, b in pairwise(names))
    return listed and all(place[a] < place[b] for a, b in order.before)


def check_order(order: FreeOrder, stops: Sequence[Stop], carried: Payload) -> None:
    """Check that an order fits its stops and does not contradict itself.

    Args:
        order: the order.
        stops: stops of the cycle.
        carried: payload at the start.

    Raises:
        ContradictoryOrder: no order of the stops exists.
        InvalidProblem: a field is malformed; names the field.
    """
    if len(stops) > MOST_FREE_STOPS:
        raise InvalidProblem(
            "stops", f"A cycle with a free order has at most {MOST_FREE_STOPS} stops."
        )
    known = [stop.name for stop in stops]
    for field, lists in (("before", order.before), ("together", order.together)):
        for k, names in enumerate(lists):
            unknown = next((name for name in names if name not in known), None)
            if unknown is not None:
                raise InvalidProblem(f"{field}.{k}", f"There is no stop named {unknown!r}.")
            if len(names) < 2 or len(set(names)) < len(names):
                raise InvalidProblem(f"{field}.{k}", "Give at least two stops, each of them once.")
    together = [name for names in order.together for name in names]
    if len(set(together)) < len(together):
        raise InvalidProblem("together", "A stop can be in one list only.")
    _check_before(order, stops)
    for group in groups_of(order, stops):
        after = [stop.payload for stop in group if stop.payload is not None]
        if after and not after[-1].is_same_body(carried):
            raise InvalidProblem(
                "together",
                f"After {group[-1].name}, the payload differs from that at the start. With a "
                "free order, list the stops between which a part is carried in `together`, the "
                "one that picks it up first.",
            )


def _check_before(order: FreeOrder, stops: Sequence[Stop]) -> None:
    groups = groups_of(order, stops)
    for first, second in order.before:
        for group in groups:
            names = [stop.name for stop in group]
            if first in names and second in names and names.index(first) > names.index(second):
                raise ContradictoryOrder(
                    f"before asks for {first!r} before {second!r}, but together lists {second!r} "
                    "first: leave out one "
                    "of them.",
                    [first, second],
                )
    try:
        TopologicalSorter(dict(enumerate(earlier_groups(order, groups)))).prepare()
    except CycleError as error:
        circle = [groups[k] for k in error.args[1]]
        needed = " before ".join(
            " and ".join(repr(stop.name) for stop in group) for group in circle
        )
        raise ContradictoryOrder(
            f"No order is possible: it would have {needed}. Leave out one of these pairs of "
            "before, or a list of "
            "together.",
            [stop.name for group in circle[:-1] for stop in group],
        ) from None
