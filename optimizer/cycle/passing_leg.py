"""Legs that pass through stops: motions between two layers through the layers of the stops between.

Such a motion depends on its configurations at all stops, its route. The bound of a route is the
greater one of the sum of bounds on the travel between successive stops, and the bound of the motion
from rest to rest between its ends. The bound of a pair of ends is the least one of all its routes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import travel_bounds
from joulepath.optimizer.cycle.kinds import displacements_between, kinds_of
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.legs import Leg, bounds_of
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.result.cycle import Pass


@dataclass(frozen=True)
class PassingLegSettings:
    """Settings of legs that pass through stops."""

    most_pairs: int = 500_000
    """Most pairs of ends of one leg; every pair has routes of its own."""
    likely_ratio: float = 1.15
    """Ratio of the weight of an unsolved route to its bound; energies are about a quarter above
    their bounds."""


PASSING = PassingLegSettings()

Route = tuple[int, ...]
"""Nodes of a motion at the stops it passes through."""


@dataclass(eq=False)
class PassingLeg(Leg):
    """All motions between two layers through others; every pair is a kind of its own.

    Attributes:
        between: layers of the passed stops.
        direct: leg without passes.
        travel: bounds of the travel from every layer to the next, shape (n_k, n_k+1) [J].
        excess: excess of the weight of unsolved pairs over their bounds, shape (s, g) [J].
        routes: best routes found, by pair.
    """

    between: list[Layer] = field(default_factory=list)
    direct: Leg | None = None
    travel: list[Array] = field(default_factory=list)
    excess: Array = field(default_factory=lambda: np.zeros(0))
    routes: dict[tuple[int, int], Route] = field(default_factory=dict)

    @classmethod
    def through(
        cls, prepared: PreparedProblem, layers: Sequence[Layer], dwell: Array
    ) -> PassingLeg:
        """The leg through the given layers.

        Raises:
            InvalidProblem: there are too many pairs.
        """
        start, *between, goal = layers
        if (
            max(len(a.q) * len(b.q) for a, b in [*pairwise(layers), (start, goal)])
            > PASSING.most_pairs
        ):
            raise InvalidProblem(
                "stops",
                f"From {start.name} through {between[0].name} to {goal.name} there are more than "
                f"{PASSING.most_pairs} pairs of arm configurations: give fewer targets, a "
                "`branch`, or `windings` false.",
            )
        return cls._of_direct(Leg.of(prepared, start, goal, dwell), between, 0.0, DURATIONS.longest)

    @classmethod
    def _of_direct(
        cls,
        direct: Leg,
        between: list[Layer],
        price: float,
        longest: float,
        excess: Array | None = None,
    ) -> PassingLeg:
        """The leg at a price of time.

        Args:
            direct: leg without passes.
            between: layers of the passed stops.
            price: price of time [W].
            longest: longest duration of a motion [s].
            excess: likely excess over the bounds, shape (s, g) [J]; None for a share of the bounds.
        """
        prepared, start, goal = direct.prepared, direct.start, direct.goal
        layers = [start, *between, goal]
        travel = [_travel_bounds(prepared, a, b, price, longest) for a, b in pairwise(layers)]
        least = np.maximum(_least_sums(travel), direct.least_costs - direct.dwell)
        kind = np.arange(least.size).reshape(least.shape)
        excess = (PASSING.likely_ratio - 1) * np.abs(least) if excess is None else excess
        return cls(
            prepared,
            start,
            goal,
            kind,
            np.column_stack(np.unravel_index(np.arange(least.size), least.shape)),
            np.zeros((0, start.q.shape[1])),
            np.zeros((0, 2)),
            least.ravel(),
            direct.dwell,
            least + excess + direct.dwell,
            between=between,
            direct=direct,
            travel=travel,
            excess=excess,
        )

    def priced(self, price: float, longest: float) -> PassingLeg:
        """The same leg, unsolved, with the energy + price · duration as cost, along the known
        routes.
        """
        assert self.direct is not None
        priced = self._of_direct(
            self.direct.priced(price, longest), self.between, price, longest, self.excess
        )
        priced.routes = self.routes
        return priced

    @property
    def layers(self) -> list[Layer]:
        """Layers of all places of the motions, in order."""
        return [self.start, *self.between, self.goal]

    def best_routes(self, s: int, g: int) -> Iterator[tuple[float, Route]]:
        """Bound [J] and nodes of the routes of a pair, by ascending bound."""
        assert self.direct is not None
        onward = [self.travel[-1][:, g]]
        for matrix in reversed(self.travel[1:-1]):
            onward.insert(0, (matrix + onward[0]).min(axis=1))
        least = float(self.direct.least_costs[s, g] - self.direct.dwell[g])
        # least sum over all continuations, sum so far, nodes so far
        heap: list[tuple[float, float, Route]] = [(0.0, 0.0, ())]
        while heap:
            total, gone, route = heappop(heap)
            if len(route) == len(self.between):
                yield max(total, least), route
                continue
            row = self.travel[len(route)][route[-1] if route else s]
            ahead = gone + row + onward[len(route)]
            for node in np.flatnonzero(np.isfinite(ahead)).tolist():
                heappush(heap, (float(ahead[node]), gone + float(row[node]), (*route, node)))

    def route(self, s: int, g: int) -> Route:
        """Best known route of a pair; without one, the route of least bound."""
        if (s, g) not in self.routes:
            self.routes[s, g] = next(self.best_routes(s, g))[1]
        return self.routes[s, g]

    def set_route(self, s: int, g: int, route: Route) -> None:
        """Let the motion of a pair take a route."""
        self.routes[s, g] = route

    def passes(self, s: int, g: int) -> list[Array]:
        """Joint positions (nq,) [rad] passed by the motion of a pair."""
        return self.configurations(self.route(s, g))

    def configurations(self, route: Route) -> list[Array]:
        """Joint positions (nq,) [rad] of a route."""
        return [layer.q[node] for layer, node in zip(self.between, route, strict=True)]

    def prepared_for(self, s: int, g: int) -> PreparedProblem:
        """Problem of a pair's motion."""
        problem = replace(
            self.prepared.problem,
            start=self.start.q[s],
            goal=self.goal.q[g],
            passes=self.passes(s, g),
        )
        return self.prepared.beside(problem)


def _travel_bounds(
    prepared: PreparedProblem, start: Layer, goal: Layer, price: float, longest: float
) -> Array:
    """Bounds (s, g) [J] of the travel from one layer to the next; see `travel_bounds`."""
    kind, pair = kinds_of(start, goal, prepared)
    displacement, levels = displacements_between(prepared, start, goal, pair)
    gain = levels[:, 1] - levels[:, 0]
    bounds = bounds_of(
        lambda x, own: travel_bounds(prepared, x, own, price, longest), displacement, gain
    )
    return np.asarray(bounds[kind])


def _least_sums(matrices: Sequence[Array]) -> Array:
    """Least sums (n_0, n_m) over all chains through matrices (n_k, n_k+1)."""
    total = matrices[0]
    for matrix in matrices[1:]:
        rows = []
        for row in total:
            checkpoint()
            rows.append((row[:, None] + matrix).min(axis=0))
        total = np.stack(rows)
    return total


def passes_of(leg: Leg, s: int, g: int, motion: Spline) -> list[Pass]:
    """Passes of the motion of a pair, with their times."""
    if not isinstance(leg, PassingLeg):
        return []
    route = leg.route(s, g)
    times = pass_times(motion.curve, np.array(leg.configurations(route))).tolist()
    return [_pass(layer, node, t) for layer, node, t in zip(leg.between, route, times, strict=True)]


def _pass(layer: Layer, node: int, t: float) -> Pass:
    end = layer.ends[layer.end[node]]
    stop = layer.name.removeprefix("stops/")
    return Pass(label=end.label, q=layer.q[node], target=end.target, stop=stop, t=t)
