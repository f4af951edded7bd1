"""Time laws along a tool path: spaces of time scalings, and initial guesses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import cumulative_trapezoid

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tool_path.joint_path import path_ratios
from joulepath.optimizer.motion import quintic, ramped
from joulepath.optimizer.motion.bspline import Basis, clamped
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.prepared_problem import PreparedProblem


@dataclass(frozen=True)
class PathTimeLawSettings:
    """Settings of time laws along a tool path."""

    even_spans: float = 30.0
    """Spans of a space of motions that are evenly spaced in time."""

    spans_per_path_span: float = 0.25
    """Further spans per span of the path, where a motion follows that span."""

    resolution: int = 40
    """Instants per span at which the density of spans is evaluated."""

    shortest_ramp: float = 0.1
    """Smallest share of the time of a ramp of the first guess."""

    ramp_per_bend: float = 1.0
    """Largest share of the time of a ramp of the first guess, divided by one more than the number
    of bends."""

    stretch: float = 1.2
    """Duration of the first guess with bends, relative to that of its ramps and its pace: the
    speed changes from bend to bend."""

    used_ramp: float = 0.8
    """Share of the length of a ramp on which the first guess reaches the least speed."""

    checked_instants: int = 2000
    """Instants at which the tolerances of the path are checked."""

    samples_per_point: int = 16
    """Samples of the path per control point, to measure along it."""


PATH_TIME_LAW = PathTimeLawSettings()


@dataclass(frozen=True, eq=False)
class PathTimeLaws:
    """Time laws along the tool path of a problem."""

    prepared: PreparedProblem

    t_min: float
    """Smallest duration [s]."""

    t_max: float
    """Largest duration [s]."""

    def space(self, path: Spline, law: tuple[Array, Array], finer: float) -> Basis:
        """Space of motions, and of time scalings, with short spans where a law is at bends.

        Its spans are evenly spaced in time, plus a share of the spans of the path. A least speed
        has further knots at the ends of its ramps.

        Args:
            path: the path.
            law: times (k,) [s] and fractions (k,) of the path.
            finer: factor on the number of spans.
        """
        settings, (t, s), count = PATH_TIME_LAW, law, self.spans(path, finer)
        knots, per_span = np.unique(path.knots), settings.spans_per_path_span
        at = np.linspace(0.0, 1.0, settings.resolution * count)
        passed = np.interp(np.interp(at, t / t[-1], s), knots, np.arange(len(knots)))
        density = settings.even_spans * at + per_span * passed
        breaks = np.interp(np.linspace(0.0, density[-1], count + 1), density, at)
        if self.prepared.least_speed is not None:
            breaks = np.unique(np.append(breaks, [self._ramp, 1 - self._ramp]).round(9))
        return Basis.of(clamped(breaks), grid_points=0)

    @staticmethod
    def spans(path: Spline, finer: float) -> int:
        """Number of spans of a `space`."""
        settings, of_path = PATH_TIME_LAW, len(np.unique(path.knots)) - 1
        return round(finer * (settings.even_spans + settings.spans_per_path_span * of_path))

    @cached_property
    def _ramp(self) -> float:
        """Share of the time of a ramp, for a least speed and constant speed between the ramps."""
        least = self.prepared.least_speed
        assert least is not None
        way = PATH_TIME_LAW.used_ramp * least.ramp / float(least.travelled[-1])
        return 2 * way / (1 + 2 * way)

    def paced(self, path: Spline) -> tuple[Array, Array]:
        """Times (k,) [s] and fractions (k,) of a motion along a path that slows down at its bends.

        At every point, the speed keeps the rates of the path's own derivatives within the limits.
        """
        settings, s = PATH_TIME_LAW, fractions(path)
        derivatives = np.stack([path.curve(s, d) for d in (1, 2, 3)])
        ratios = np.abs(derivatives) / self.prepared.arm.active_limits.rates[:, None]
        pace: Array = (ratios.max(axis=2) ** (1 / np.arange(1, 4))[:, None]).max(axis=0)
        if self.prepared.path is not None:
            pace = np.maximum(
                pace, self.prepared.path.speed_ratios(path.curve(s), path.curve(s, 1))
            )
        t = np.asarray(cumulative_trapezoid(pace, s, initial=0))
        at = np.linspace(0.0, 1.0, settings.checked_instants)
        assert self.prepared.course is not None
        bends = self.prepared.course.shape.bends
        # the peak of the quintic is this pace; with bends, and in less time, the ramps are shorter
        most, ramp = quintic.PEAKS[0] * t[-1], np.inf
        if self.prepared.least_speed is not None:
            ramp = self._ramp
            most = t[-1] / (1 - ramp)
        elif bends:
            ramp = settings.ramp_per_bend / (1 + bends)
            most = settings.stretch * t[-1] / (1 - ramp)
        duration = float(np.clip(most, self.t_min, self.t_max))
        if duration < most and self.prepared.least_speed is None:
            ramp = float(np.clip(1 - t[-1] / duration, settings.shortest_ramp, min(ramp, 0.5)))
        law = quintic.fraction(at) if ramp == np.inf else ramped.fraction(at, ramp)
        return at * duration, np.interp(law, t / t[-1], s)

    def keeps_to_path(self, motion: Spline) -> bool:
        """Whether a motion keeps the tolerances of the path."""
        assert self.prepared.course is not None
        q, _, _ = sample(motion, np.linspace(0.0, motion.duration, PATH_TIME_LAW.checked_instants))
        return max(path_ratios(self.prepared.arm, self.prepared.course, q).values()) <= 1


def on_path(path: Spline, q: Array, t: Array) -> tuple[Array, Array]:
    """Times t (k,) [s], and fractions (k,) of the path at which a motion q (k, nq) is then.

    The fractions follow from the joint-space length of the motion so far.
    """
    s = fractions(path)
    travelled, length = joint_length(q), joint_length(path.curve(s))
    return t, np.interp(travelled / travelled[-1], length / length[-1], s)


def fractions(path: Spline) -> Array:
    """Evenly spaced fractions (k,) of a path, to measure along it."""
    return np.linspace(0.0, 1.0, PATH_TIME_LAW.samples_per_point * len(path.control_points))


def joint_length(q: Array) -> Array:
    """Joint-space length (k,) [rad] of a polyline q (k, nq) up to its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
