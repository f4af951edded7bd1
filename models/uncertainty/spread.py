"""Errors of a robot's figures: random draws, and the covariance of every source.

Identified figures have the covariance of their document. All others have the ranges of
`default_ranges.yaml`: lognormal for factors and positive values, uniform for ranges from zero.
Figures of one kind of motor share a factor: one for the large joints, one for the small joints. The
draws are a Latin hypercube with fixed seed, so that equal figures have equal draws everywhere.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import ndtr, ndtri

from joulepath.models.robot import Array, Robot
from joulepath.models.trust import trust_letters
from joulepath.models.uncertainty.document import Covariance, covariance_of
from joulepath.models.uncertainty.parameters import BASE_POWER, LINKS, count, index, place, values
from joulepath.models.uncertainty.ranges import default_ranges, large_joints, lognormal, range_of

DRAWS = 2048
"""Random draws of the figures."""
FRICTION = "friction"
LOAD = "load"
SESSION = "session"
INERTIALS = "inertials"
_DRY = ("coulomb", "curved", "viscous")
Places = set[tuple[str, int]]
"""Figures and joints."""


@dataclass(frozen=True)
class SpreadSettings:
    """Settings of the draws."""

    seed: int = 18
    """Seed of the Latin hypercube."""
    cached: int = 16
    """Robots with cached draws, a megabyte each."""
    rounding: float = 1e-6
    """Share of the greatest variance below which a variance is rounding."""


SETTINGS = SpreadSettings()


@dataclass(frozen=True)
class Spread:
    """Errors of the figures in `parameters.values`, with links if the document has their errors.

    `mean` (p,) are mean deviations from the robot's figures, and `draws` (n, p) deviations from the
    mean. `covariances` (p, p) belong to sources by name: a figure to measure, or `session`. `root`
    (p, r) maps independent standard normal factors to their sum. `move_draws` (2, n) [W] are
    independent draws of the mean power of model errors in a motion, with standard deviation
    `move_sd` [W].
    """

    mean: Array
    draws: Array
    root: Array
    covariances: dict[str, Array]
    move_draws: Array
    move_sd: float


@lru_cache(SETTINGS.cached)
def spread_of(robot: Robot, law: str, known: tuple[str, ...] = ()) -> Spread:
    """The spread of a robot's figures with one friction law; figures in `known` have no error."""
    return _Sources(robot, law, known).spread()


@dataclass
class _Sources:
    """Accumulates the sources of error of a robot's figures."""

    robot: Robot
    law: str
    given: tuple[str, ...]
    deviations: dict[str, Array] = field(default_factory=dict)
    _columns: int = 0

    @cached_property
    def _known(self) -> Covariance | None:
        return covariance_of(self.robot.figures)

    @cached_property
    def _size(self) -> int:
        """Length p of the vector."""
        links = self._known is not None and not set(LINKS).isdisjoint(
            name for name, _ in self._known.places(self.law)
        )
        return count(self.robot.nq, links)

    def spread(self) -> Spread:
        known = self._known
        # The covariance of another friction law does not apply.
        identified = set() if known is None else {*known.places(self.law)}
        self._electronics(identified)
        self._friction(identified)
        self._drives(identified)
        covariances = {name: np.cov(each.T) for name, each in self.deviations.items()}
        draws = sum(self.deviations.values(), np.zeros((DRAWS, self._size)))
        move_sd = 0.0
        if known is not None and identified:
            own, covariance = self._identified(known)
            draws, move_sd = draws + own, known.move_sd
            masks = dict[str, Array]()
            for name in sorted({figure for figure, _ in known.places(self.law)}):
                source = INERTIALS if name in LINKS else name
                masks.setdefault(source, np.zeros(len(covariance)))[place(name, self.robot.nq)] = (
                    1.0
                )
            for source, mask in masks.items():
                # The covariance of two figures counts half for either source.
                covariances[source] = covariance * (mask[:, None] + mask) / 2
            session = self._session(known.session_sd, identified)
            draws, covariances[SESSION] = draws + session, np.cov(session.T)
        certain = np.ones(self._size)
        for name in self.given:
            certain[place(name, self.robot.nq)] = 0.0
        covariances = {
            name: each * np.outer(certain, certain) for name, each in covariances.items()
        }
        mean = draws.mean(axis=0) * certain
        moves = move_sd * np.stack([self._normal(), self._normal()])
        return Spread(
            mean,
            draws * certain - mean,
            root_of(np.sum(list(covariances.values()), axis=0)),
            covariances,
            moves,
            move_sd,
        )

    @property
    def _nominal(self) -> Array:
        robot = self.robot
        power = robot.electronics.idle_power + robot.electronics.controller_power
        law = next(each for each in robot.friction_laws.values() if each.name == self.law)
        return values(law, robot.drives, power)

    def _normal(self) -> Array:
        """Standard normal draws (n,), one from each of n strips of equal probability, shuffled."""
        self._columns += 1
        order = np.random.default_rng([SETTINGS.seed, self._columns]).permutation(DRAWS)
        return np.asarray(ndtri((order + 0.5) / DRAWS))

    def _factor(self, name: str, letters: AbstractSet[str] = frozenset()) -> Array:
        """Draws (n,) of a factor or value with the range of this name."""
        low, high = range_of(name, letters)
        normal = self._normal()
        if low == 0:
            return np.asarray(high / 0.95 * ndtr(normal))
        middle, width = lognormal(low, high)
        return np.asarray(np.exp(middle + width * normal))

    def _add(self, source: str, name: str, deviation: Array) -> None:
        """A deviation (n,) or (n, nq) of the figure `name`."""
        nq = self.robot.nq
        known = self.deviations.setdefault(source, np.zeros((DRAWS, self._size)))
        known[:, place(name, nq)] += deviation.reshape(DRAWS, -1)

    def _unknown(self, names: tuple[str, ...], identified: Places) -> Array:
        """1 for each joint (nq,) without identified figures of these names, 0 for all others."""
        joints = range(self.robot.nq)
        return np.array([float(all((name, j) not in identified for name in names)) for j in joints])

    def _letters(self, section: str, name: str) -> set[str]:
        return trust_letters(self.robot.figures.get(section, {}).get(name))

    def _electronics(self, identified: Places) -> None:
        if (BASE_POWER, 0) not in identified:
            factor = self._factor("idle_power", self._letters("electronics", "idle_power"))
            self._add("idle_power", BASE_POWER, self.robot.electronics.idle_power * (factor - 1))

    def _friction(self, identified: Places) -> None:
        """Of joints without identification: one factor common to all, and one factor for each."""
        nominal, nq = self._nominal, self.robot.nq
        law = self.robot.figures.get("friction_laws", {}).get(self.law, {})
        unknown = self._unknown(_DRY, identified)
        if unknown.any():
            common = self._factor("friction_common")[:, None]
            joints = [self._factor("friction_joint", trust_letters(law)) for _ in range(nq)]
            factor = common * np.stack(joints, axis=1)
            for name in _DRY:
                self._add(FRICTION, name, unknown * nominal[place(name, nq)] * (factor - 1))
        loaded = unknown * self._unknown((LOAD,), identified)
        loaded *= np.arange(nq) < default_ranges()[LOAD]["joints"]
        # zeros of a law with a load are the robot's own, unless logs identified others of them
        named = "load" in law and not any(name == LOAD for name, _ in identified)
        if loaded.any() and not named:
            unnamed = nominal[place(LOAD, nq)] == 0
            self._add(LOAD, "load", self._factor(LOAD)[:, None] * loaded * unnamed)

    def _drives(self, identified: Places) -> None:
        nominal, nq = self._nominal, self.robot.nq
        large = large_joints(self.robot)
        for name in ("torque_constant", "rotor_inertia", "copper"):
            unknown = self._unknown((name,), identified)
            if not unknown.any():
                continue
            letters = self._letters("drives", name)
            ranges = ("copper_large", "copper_small") if name == "copper" else (name, name)
            first, second = (self._factor(each, letters)[:, None] for each in ranges)
            factor = np.where(large, first, second)
            self._add(name, name, unknown * nominal[place(name, nq)] * (factor - 1))
        name = "inverter_linear"
        unknown = self._unknown((name,), identified)
        if unknown.any() and not (unknown * nominal[place(name, nq)]).any():
            self._add(name, name, self._factor(name)[:, None] * unknown)

    def _identified(self, known: Covariance) -> tuple[Array, Array]:
        """Draws (n, p) with the covariance of the document, and this covariance (p, p)."""
        nq = self.robot.nq
        chosen = [
            k for k, name in enumerate(known.names) if known.place_of(name, self.law) is not None
        ]
        at = [index(name, joint, nq) for name, joint in known.places(self.law)]
        covariance = np.zeros((self._size, self._size))
        covariance[np.ix_(at, at)] = known.matrix[np.ix_(chosen, chosen)]
        root = root_of(covariance)
        normal = np.empty((DRAWS, root.shape[1]))
        for column in normal.T:
            column[:] = self._normal()
        return normal @ root.T, covariance

    def _session(self, session_sd: Array, identified: Places) -> Array:
        """Draws (n, p) of the friction on another day: one factor for all identified joints, or an
        independent one for each."""
        nq, result = self.robot.nq, np.zeros((DRAWS, self._size))
        count = nq if session_sd.ndim else 1
        factor = session_sd * np.stack([self._normal() for _ in range(count)], axis=1)
        known = 1 - self._unknown((*_DRY, LOAD), identified)
        for name in (*_DRY, LOAD):
            result[:, place(name, nq)] = factor * known * self._nominal[place(name, nq)]
        return result


def root_of(covariance: Array, least: float = SETTINGS.rounding) -> Array:
    """A matrix R (p, r) with R Rᵀ equal to the covariance (p, p) of p figures.

    Common errors are left out whose variance, with figures of unit deviation, is at most `least` of
    the largest one.
    """
    # Figures have different units: scale them by their standard deviations.
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0, sd, 1.0)
    size, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = size > least * size[-1]
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(size[kept]))
