"""What the errors of a robot's figures may be: draws of them, and the covariance of each source.

Identified figures have the covariance of their document. The others have the ranges of
`default_ranges.yaml`: lognormal where they are factors or positive values, and evenly spread from
zero on. Figures of one kind of motor err together: the large joints share a factor, and so do the
small ones. The draws are a Latin hypercube of fixed seed: the same figures have the same draws
everywhere.
"""

from __future__ import annotations

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
SEED = 18
# robots whose draws are kept: a megabyte each
MOST_SPREADS = 16
# share of the greatest variance that is rounding
ROUNDING = 1e-6
FRICTION, LOAD, SESSION, INERTIALS = "friction", "load", "session", "inertials"
_DRY = ("coulomb", "curved", "viscous")


@dataclass(frozen=True)
class Spread:
    """Errors of the figures of `parameters.values`, and of the links' if the robot's document has
    such errors.

    `mean` (p,) are the means of the deviations from the robot's own figures, `draws` (n, p) are
    about these means. `covariances` (p, p) are those of each source, by name: a figure to measure,
    or `session`. `root` (p, r) makes their sum of independent standard normal factors. `move_draws`
    (2, n) [W] are independent draws of what the model cannot express of a motion, as a mean power,
    and `move_sd` [W] is their standard deviation.
    """

    mean: Array
    draws: Array
    root: Array
    covariances: dict[str, Array]
    move_draws: Array
    move_sd: float


@lru_cache(MOST_SPREADS)
def spread_of(robot: Robot, law: str, known: tuple[str, ...] = ()) -> Spread:
    """The spread of a robot's figures with the friction law of this name. Those of `known` have no
    error.
    """
    return _Sources(robot, law, known).spread()


@dataclass
class _Sources:
    """The sources of error of a robot's figures, one after the other."""

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
        # that of another law says nothing of this one's figures
        identified = set() if known is None else {name for name, _ in known.places(self.law)}
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
                # what is shared with other figures counts half for each
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
            _root(np.sum(list(covariances.values()), axis=0)),
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
        """A standard normal column (n,): one value of each of n strips of equal probability, in
        random order.
        """
        self._columns += 1
        order = np.random.default_rng([SEED, self._columns]).permutation(DRAWS)
        return np.asarray(ndtri((order + 0.5) / DRAWS))

    def _factor(self, name: str, letters: set[str] = frozenset()) -> Array:  # type: ignore[assignment]
        """Draws (n,) of a range: of a factor, or of a value."""
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

    def _letters(self, section: str, name: str) -> set[str]:
        return trust_letters(self.robot.figures.get(section, {}).get(name))

    def _electronics(self, identified: set[str]) -> None:
        if BASE_POWER not in identified:
            factor = self._factor("idle_power", self._letters("electronics", "idle_power"))
            self._add("idle_power", BASE_POWER, self.robot.electronics.idle_power * (factor - 1))

    def _friction(self, identified: set[str]) -> None:
        """Of a law without identified figures: a factor for all joints, and one for each."""
        nominal, nq = self._nominal, self.robot.nq
        law = self.robot.figures.get("friction_laws", {}).get(self.law, {})
        if not identified & set(_DRY):
            common = self._factor("friction_common")[:, None]
            joints = [self._factor("friction_joint", trust_letters(law)) for _ in range(nq)]
            factor = common * np.stack(joints, axis=1)
            for name in _DRY:
                self._add(FRICTION, name, nominal[place(name, nq)] * (factor - 1))
        if LOAD not in identified and "load" not in law:
            loaded = np.arange(nq) < default_ranges()[LOAD]["joints"]
            self._add(LOAD, "load", self._factor(LOAD)[:, None] * loaded)

    def _drives(self, identified: set[str]) -> None:
        nominal, nq = self._nominal, self.robot.nq
        large = large_joints(self.robot)
        for name in ("torque_constant", "rotor_inertia", "copper"):
            if name in identified:
                continue
            letters = self._letters("drives", name)
            ranges = ("copper_large", "copper_small") if name == "copper" else (name, name)
            first, second = (self._factor(each, letters)[:, None] for each in ranges)
            self._add(name, name, nominal[place(name, nq)] * (np.where(large, first, second) - 1))
        if "inverter_linear" not in identified and not nominal[place("inverter_linear", nq)].any():
            self._add(
                "inverter_linear",
                "inverter_linear",
                np.tile(self._factor("inverter_linear")[:, None], nq),
            )

    def _identified(self, known: Covariance) -> tuple[Array, Array]:
        """Draws (n, p) of the figures of the document's covariance, and this (p, p)."""
        nq = self.robot.nq
        chosen = [
            k for k, name in enumerate(known.names) if known.place_of(name, self.law) is not None
        ]
        at = [index(name, joint, nq) for name, joint in known.places(self.law)]
        covariance = np.zeros((self._size, self._size))
        covariance[np.ix_(at, at)] = known.matrix[np.ix_(chosen, chosen)]
        root = _root(covariance)
        normal = np.empty((DRAWS, root.shape[1]))
        for column in normal.T:
            column[:] = self._normal()
        return normal @ root.T, covariance

    def _session(self, session_sd: float, identified: set[str]) -> Array:
        """Draws (n, p) of the friction of another day: one factor for all joints."""
        nq, result = self.robot.nq, np.zeros((DRAWS, self._size))
        factor = session_sd * self._normal()
        for name in (*_DRY, "load"):
            if identified & {*_DRY, "load"}:
                result[:, place(name, nq)] = factor[:, None] * self._nominal[place(name, nq)]
        return result


def _root(covariance: Array) -> Array:
    """A matrix (p, r) whose product with its transpose is the covariance (p, p), without what is
    rounding.
    """
    # figures have different units: each is scaled by its own standard deviation
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0, sd, 1.0)
    size, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = size > ROUNDING * size[-1]
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(size[kept]))
