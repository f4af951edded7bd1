"""Tree of bounding balls over many small parts, searched for the parts near segments.

The parts of a node are halved several times per level, at the median along the longest extent of
their centres. The search goes down the tree level by level, for all queries together. Its effort
per query grows with the logarithm of the number of parts, unless many parts are equally near.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.cores import Indices
from joulepath.optimizer.deadline import checkpoint


@dataclass(frozen=True)
class TreeSettings:
    """Form of the tree, and blocks of its searches."""

    leaf_parts: int = 16
    """Largest number of parts of a leaf."""
    queries_per_block: int = 1024
    """Queries that are searched at once; they bound the memory."""
    halvings_per_level: int = 3
    """Halvings of the parts of a node per level of the tree."""
    rounding: float = 1e-9
    """Loosening of distance bounds [m], far above their rounding errors."""


TREE = TreeSettings()


class BoundingTree:
    """Tree over parts enclosed by balls with centres (n, 3) and radii (n,) [m]."""

    def __init__(self, centres: Array, radii: Array) -> None:
        self.centres, self.radii = centres, radii
        self.order = np.arange(len(centres))
        spans, children = [(0, len(centres))], [(0, 0)]
        for node, (begin, end) in enumerate(spans):  # The list grows during the loop.
            if end - begin > TREE.leaf_parts:
                parts = self._split(begin, end)
                children[node] = len(spans), len(spans) + len(parts)
                spans += parts
                children += [(0, 0)] * len(parts)
        self._spans: Indices = np.array(spans, dtype=np.intp)
        self._children: Indices = np.array(children, dtype=np.intp)
        self._node_centres, self._node_radii = self._balls()

    def patches(self, most: int) -> list[int]:
        """At most `most` nodes that together contain every part exactly once: the root, or nodes of
        one depth and leaves.
        """
        nodes = [0]
        while True:
            finer = [child for node in nodes for child in (range(*self._children[node]) or [node])]
            if len(finer) > most or len(finer) == len(nodes):
                return nodes
            nodes = finer

    def parts(self, node: int) -> Indices:
        """Parts (k,) below a node."""
        begin, end = self._spans[node]
        return self.order[begin:end]

    def near(
        self, segments: Array, reach: Array, within: Array, root: Indices, nearest: bool = False
    ) -> tuple[Indices, Indices]:
        """All (query, part) (m,) with a distance that may be at most `within`.

        A query is a body inside the capsule around a segment.

        Args:
            segments: segments of the queries (k, 2, 3) [m].
            reach: radii of the capsules (k,) [m].
            within: limits of the distances (k,) [m].
            root: nodes (k,) below which parts are searched.
            nearest: whether parts that cannot be the nearest part of their query are left out, too.
        """
        blocks = [
            self._near(
                segments[block], reach[block], within[block], root[block], nearest, block.start
            )
            for block in (
                slice(low, low + TREE.queries_per_block)
                for low in range(0, len(segments), TREE.queries_per_block)
            )
        ]
        empty = np.zeros(0, dtype=np.intp)
        return (
            np.concatenate([empty, *(query for query, _ in blocks)]),
            np.concatenate([empty, *(part for _, part in blocks)]),
        )

    def _near(
        self,
        segments: Array,
        reach: Array,
        within: Array,
        root: Indices,
        nearest: bool,
        offset: int,
    ) -> tuple[Indices, Indices]:
        checkpoint()
        within = within + TREE.rounding
        query: Indices = np.arange(len(segments))
        node = root
        leaves: list[tuple[Indices, Indices]] = []
        while len(query):
            keep = self._kept(
                segments,
                reach,
                within,
                query,
                self._node_centres[node],
                self._node_radii[node],
                nearest,
            )
            query, node = query[keep], node[keep]
            inner = self._children[node, 1] > 0
            leaves.append((query[~inner], node[~inner]))
            query, node = _expanded(query[inner], self._children[node[inner]])
        query = np.concatenate([each for each, _ in leaves])
        query, place = _expanded(query, self._spans[np.concatenate([each for _, each in leaves])])
        part = self.order[place]
        keep = self._kept(
            segments, reach, within, query, self.centres[part], self.radii[part], nearest
        )
        if nearest:
            # Once more, since the limits have shrunk over all parts of a query.
            query, part = query[keep], part[keep]
            keep = self._kept(
                segments, reach, within, query, self.centres[part], self.radii[part], nearest
            )
        return query[keep] + offset, part[keep]

    @staticmethod
    def _kept(
        segments: Array,
        reach: Array,
        within: Array,
        query: Indices,
        centres: Array,
        radii: Array,
        nearest: bool,
    ) -> Indices:
        """Indices of the balls that may contain a part within the limit.

        With `nearest`, `within` is lowered in place to a distance that some part of a ball has for
        certain.
        """
        distance, blur = point_segment(centres, segments[query]), radii + reach[query]
        if nearest:
            np.minimum.at(within, query, distance + blur + TREE.rounding)
        return np.flatnonzero(distance - blur <= within[query])

    def _split(self, begin: int, end: int) -> list[tuple[int, int]]:
        spans = [(begin, end)]
        for _ in range(TREE.halvings_per_level):
            spans = [half for low, high in spans for half in self._halved(low, high)]
        return spans

    def _halved(self, begin: int, end: int) -> list[tuple[int, int]]:
        if end - begin <= TREE.leaf_parts:
            return [(begin, end)]
        order = self.order[begin:end]
        centres = self.centres[order]
        middle = (end - begin) // 2
        axis = int(np.ptp(centres, axis=0).argmax())
        self.order[begin:end] = order[np.argpartition(centres[:, axis], middle)]
        return [(begin, begin + middle), (begin + middle, end)]

    def _balls(self) -> tuple[Array, Array]:
        """Centres (m, 3) and radii (m,) [m] of balls around the parts of every node."""
        node, place = _expanded(np.arange(len(self._spans)), self._spans)
        first = np.append(0, np.cumsum(np.diff(self._spans)[:-1]))
        c, r = self.centres[self.order[place]], self.radii[self.order[place]]
        low, high = (
            np.minimum.reduceat(c - r[:, None], first),
            np.maximum.reduceat(c + r[:, None], first),
        )
        centres = (low + high) / 2
        return centres, np.maximum.reduceat(np.linalg.norm(c - centres[node], axis=1) + r, first)


def point_segment(points: Array, segments: Array) -> Array:
    """Distances (k,) [m] of points (k, 3) from segments (k, 2, 3)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    square = np.einsum("ki,ki->k", along, along)
    offset = points - start
    fraction = np.clip(np.einsum("ki,ki->k", offset, along) / np.maximum(square, 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - fraction[:, None] * along, axis=1))


def _expanded(query: Indices, spans: Indices) -> tuple[Indices, Indices]:
    """Every member of the spans (k, 2), with its query (k,)."""
    count = spans[:, 1] - spans[:, 0]
    begin = np.repeat(spans[:, 0] - np.cumsum(count) + count, count)
    return np.repeat(query, count), begin + np.arange(len(begin))
