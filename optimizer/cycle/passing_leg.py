"""The legs that pass through stops: motions from one layer to another through the layers of the
stops between them.

Such a motion depends on the configurations at all of its stops, a route. Its bound is the sum of
the bounds on the travel from each to the next, or that of the motion from rest to rest between its
ends if this is greater. The bound of a pair of ends is the least of all routes between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import travel_bounds
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.legs import Leg, between, bounds_of, kinds_of
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import LONGEST_DURATION
from joulepath.optimizer.result.cycle import Pass

# pairs of ends of one leg, each of which has routes of its own
MOST_PASSING_PAIRS = 500_000
# what a motion needs is some quarter above its bound: a route that is not solved weighs so much
# more than its bound
LIKELY = 1.15

Route = tuple[int, ...]


@dataclass(eq=False)
class PassingLeg(Leg):
    """All motions from one layer to the next through the layers `between`; every pair is a kind of
    its own.

    `direct` is the leg without passes, and `travel` the bounds [J] on the parts, a matrix from each
    layer to the next. Bounds are far below what is found, so that an unsolved pair weighs more than
    its bound in `cost`: by `beyond` (s, g) [J]. `routes` are the best ones found, by pair.
    """

    between: list[Layer] = field(default_factory=list)
    direct: Leg | None = None
    travel: list[Array] = field(default_factory=list)
    beyond: Array = field(default_factory=lambda: np.zeros(0))
    routes: dict[tuple[int, int], Route] = field(default_factory=dict)

    @classmethod
    def through(
        cls, prepared: PreparedProblem, layers: Sequence[Layer], dwell: Array
    ) -> PassingLeg:
        """The leg from the first layer through the others to the last. Raises InvalidProblem if it
        has many pairs.
        """
        start, *between, goal = layers
        if (
            max(len(a.q) * len(b.q) for a, b in [*pairwise(layers), (start, goal)])
            > MOST_PASSING_PAIRS
        ):
            raise InvalidProblem(
                "stops",
                f"From {start.name} through {between[0].name} to {goal.name} there are more than "
                f"{MOST_PASSING_PAIRS} "
                "pairs of arm configurations: give fewer targets, a `branch`, or `windings` false.",
            )
        return cls._of(Leg.of(prepared, start, goal, dwell), between, 0.0, LONGEST_DURATION)

    @classmethod
    def _of(
        cls,
        direct: Leg,
        between: list[Layer],
        price: float,
        longest: float,
        beyond: Array | None = None,
    ) -> PassingLeg:
        """The leg at a price of time [W], with motions of at most `longest` [s].

        They are likely to need so much more than their bounds, `beyond` (s, g) [J].
        """
        prepared, start, goal = direct.prepared, direct.start, direct.goal
        layers = [start, *between, goal]
        travel = [_travel(prepared, a, b, price, longest) for a, b in pairwise(layers)]
        least = np.maximum(_least_sums(travel), direct.least_costs - direct.dwell)
        kind = np.arange(least.size).reshape(least.shape)
        beyond = (LIKELY - 1) * np.abs(least) if beyond is None else beyond
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
            least + beyond + direct.dwell,
            between=between,
            direct=direct,
            travel=travel,
            beyond=beyond,
        )

    def priced(self, price: float, longest: float) -> PassingLeg:
        """The same leg with what energy + price · duration needs, along the routes that are known;
        none solved.
        """
        assert self.direct is not None
        priced = self._of(
            self.direct.priced(price, longest), self.between, price, longest, self.beyond
        )
        priced.routes = self.routes
        return priced

    @property
    def layers(self) -> list[Layer]:
        """The layers of all places of its motions, in their order."""
        return [self.start, *self.between, self.goal]

    def best_routes(self, s: int, g: int) -> Iterator[tuple[float, Route]]:
        """Bound [J] and nodes between them of each route of a pair, in the order of the bounds."""
        assert self.direct is not None
        onward = [self.travel[-1][:, g]]
        for matrix in reversed(self.travel[1:-1]):
            onward.insert(0, (matrix + onward[0]).min(axis=1))
        least = float(self.direct.least_costs[s, g] - self.direct.dwell[g])
        # least sum over all ways on, sum so far, nodes so far
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
        """The best route found of a pair; if none is, the one of the least bound."""
        if (s, g) not in self.routes:
            self.routes[s, g] = next(self.best_routes(s, g))[1]
        return self.routes[s, g]

    def passes(self, s: int, g: int) -> list[Array]:
        """Joint positions (nq,) [rad] that the motion of a pair passes through."""
        return self.configurations(self.route(s, g))

    def configurations(self, route: Route) -> list[Array]:
        """Joint positions (nq,) [rad] of a route."""
        return [layer.q[node] for layer, node in zip(self.between, route, strict=True)]

    def prepared_for(self, s: int, g: int) -> PreparedProblem:
        """The problem of a pair's motion."""
        problem = replace(
            self.prepared.problem,
            start=self.start.q[s],
            goal=self.goal.q[g],
            passes=self.passes(s, g),
        )
        return PreparedProblem.of(problem)


def _travel(
    prepared: PreparedProblem, start: Layer, goal: Layer, price: float, longest: float
) -> Array:
    """Bounds (s, g) [J] on the travel from one layer to the next; see `travel_bounds`."""
    kind, pair = kinds_of(start, goal, prepared)
    displacement, levels = between(prepared, start, goal, pair)
    gain = levels[:, 1] - levels[:, 0]
    bounds = bounds_of(
        lambda x, own: travel_bounds(prepared, x, own, price, longest), displacement, gain
    )
    return np.asarray(bounds[kind])


def _least_sums(matrices: Sequence[Array]) -> Array:
    """The least sum (n_0, n_m) over all chains through matrices (n_k, n_k+1)."""
    total = matrices[0]
    for matrix in matrices[1:]:
        rows = []
        for row in total:
            checkpoint()
            rows.append((row[:, None] + matrix).min(axis=0))
        total = np.stack(rows)
    return total


def passes_of(leg: Leg, s: int, g: int, motion: Spline) -> list[Pass]:
    """Where the motion of a pair passes through stops."""
    if not isinstance(leg, PassingLeg):
        return []
    route = leg.route(s, g)
    times = pass_times(motion.curve, np.array(leg.configurations(route))).tolist()
    return [_pass(layer, node, t) for layer, node, t in zip(leg.between, route, times, strict=True)]


def _pass(layer: Layer, node: int, t: float) -> Pass:
    end = layer.ends[layer.end[node]]
    stop = layer.name.removeprefix("stops/")
    return Pass(label=end.label, q=layer.q[node], target=end.target, stop=stop, t=t)
