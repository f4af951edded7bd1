"""A motion as a clamped B-spline: samples, quadrature samples, peak rates, retiming."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.declared import Axes, Count, Unit
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.presentation.equality import Comparable


@dataclass(frozen=True)
class SamplingSettings:
    """Sampling of motions."""

    longest_panel: float = 0.2
    """Greatest length of a quadrature panel [s]."""
    least_panels: int = 64
    """Least number of quadrature panels of a motion."""
    most_panels: int = 2000
    """Greatest number of quadrature panels of a motion with fewer knot spans."""
    points_per_span: int = 33
    """Samples per knot span in the search for peaks of speed, acceleration and jerk."""
    fit_samples: int = 201
    """Samples of a motion to which another spline is fitted."""


SAMPLING = SamplingSettings()


@dataclass(frozen=True, eq=False)
class Spline(Comparable):
    """Clamped B-spline of the joint positions over time."""

    degree: Count
    """Degree."""
    knots: Annotated[Array, Axes(("knot",)), Unit("s")]
    """Knots."""
    control_points: Annotated[Array, Axes(("point", "joint")), Unit("rad")]
    """Control points, `[point][joint]`."""

    def __repr__(self) -> str:
        points, joints = self.control_points.shape
        return (
            f"Spline({joints} joints, {self.duration:.4g} s, degree {self.degree}, "
            f"{points} control points)"
        )

    @property
    def duration(self) -> float:
        """Length of the motion [s]."""
        return float(self.knots[-1])

    @property
    def curve(self) -> BSpline:
        """SciPy's spline: curve(t, d) is the d-th derivative of q, (k, nq), at times t (k,) [s]."""
        # Without SciPy's checks, since they take longer than most evaluations.
        return BSpline.construct_fast(self.knots, self.control_points, self.degree)


def spline_of(basis: bspline.Basis, points: Array, duration: float) -> Spline:
    """Motion of `duration` [s] with the points (n, nq) [rad] of a spline space."""
    return Spline(basis.degree, basis.knots * duration, basis.to_spline(points))


def sample(spline: Spline, t: Array) -> tuple[Array, Array, Array]:
    """q [rad], v [rad/s], a [rad/s²], (k, nq) each, at times t (k,) [s]."""
    curve = spline.curve
    return curve(t), curve(t, 1), curve(t, 2)


def sampled(spline: Spline) -> tuple[Array, Array]:
    """At least `SAMPLING.fit_samples` samples q (k, nq) [rad] at times t (k,) [s], with samples in
    all knot spans, for fits of other splines.
    """
    t = bspline.in_all_spans(spline.knots, SAMPLING.fit_samples)
    return np.asarray(spline.curve(t)), t


def fine_samples(spline: Spline, per_panel: int) -> tuple[Array, Array, Array, Array]:
    """Quadrature weights (k,) [s] and q, v, a (k, nq) at the Gauss-Legendre points of panels within
    the knot spans.
    """
    longest = max(
        min(SAMPLING.longest_panel, spline.duration / SAMPLING.least_panels),
        spline.duration / SAMPLING.most_panels,
    )
    points, weights = quadrature(spline.knots, per_panel, longest)
    return weights, *sample(spline, points)


def peak_rates(spline: Spline) -> Array:
    """Greatest absolute speed, acceleration and jerk of every joint, (3, nq)."""
    return np.asarray(span_peak_rates(spline).max(axis=1))


def span_peak_rates(spline: Spline) -> Array:
    """Greatest absolute speed, acceleration and jerk of every joint in every knot span, (3, spans,
    nq).

    Every knot span is expanded around its middle, so both sides of a repeated knot count. Every
    sample is raised to the vertex of the parabola through the sample and its neighbours; this is
    exact for a quintic, since its jerk is a parabola. Samples are denser for higher degrees.
    """
    terms, curve = spline.degree + 1, spline.curve
    edges = np.unique(spline.knots)
    middle, half = (edges[:-1] + edges[1:]) / 2, np.diff(edges) / 2
    # Spans as polynomials in x ∈ [-1, 1] around their middles.
    series = np.stack([curve(middle, k) * half[:, None] ** k for k in range(terms)])
    powers, flat = _powers(spline.degree), series.reshape(terms, -1)
    size = np.abs([powers[:, : terms - d] @ flat[d:] for d in range(1, 4)])
    low, top, high = size[:, :-2], size[:, 1:-1], size[:, 2:]
    bend = 2 * top - low - high
    # The vertex counts only between the two outer samples.
    vertex = np.where(np.abs(high - low) <= 2 * bend, (high - low) ** 2 / (8 * bend + 1e-300), 0.0)
    peaks = np.maximum(size[:, [0, -1]].max(axis=1), (top + vertex).max(axis=1))
    return np.asarray(
        peaks.reshape(3, len(half), -1) / half[:, None] ** np.arange(1, 4)[:, None, None]
    )


@cache
def _powers(degree: int) -> Array:
    """Terms x^k / k! (points, degree + 1) of a Taylor series at points x of [-1, 1]."""
    x = np.linspace(
        -1.0, 1.0, (SAMPLING.points_per_span - 1) * (1 + 3 * max(degree - bspline.DEGREE, 0)) + 1
    )
    return np.stack([x**k / math.factorial(k) for k in range(degree + 1)], axis=1)


def time_scales(ratios: Array) -> Array:
    """Factors (...) on the duration that reduce all ratios of speed, acceleration and jerk (..., 3,
    nq) to at most 1.

    With time scaled by k, speed is divided by k, acceleration by k² and jerk by k³.
    """
    return np.asarray((ratios.max(axis=-1) ** (1 / np.arange(1, 4))).max(axis=-1))


def time_scale(ratios: Array) -> float:
    """Factor of `time_scales` for one motion with ratios (3, nq)."""
    return float(time_scales(ratios))


def least_time_scale(spline: Spline, rates: Array) -> float:
    """Least factor on the duration for a motion within the limits `rates` (3, nq) of
    `Limits.rates`.
    """
    return time_scale(peak_rates(spline) / rates)


def retimed(spline: Spline, factor: float) -> Spline:
    """The motion along the same path with time scaled by `factor`."""
    return replace(spline, knots=spline.knots * factor)


def lasting(spline: Spline, duration: float) -> Spline:
    """The motion along the same path with time scaled to a length of exactly `duration` [s]."""
    return (
        spline
        if duration == spline.duration
        else replace(spline, knots=spline.knots / spline.duration * duration)
    )


def resting_until(spline: Spline, duration: float) -> Spline:
    """The motion with a rest at its goal until `duration` [s], which is longer than the motion.

    The motion ends at rest, so q, v and a are continuous at the knot of multiplicity degree - 2.
    """
    end = spline.degree + 1
    tail = [spline.duration] * (spline.degree - 2) + [duration] * end
    rest = np.repeat(spline.control_points[-1:], spline.degree - 2, axis=0)
    return replace(
        spline,
        knots=np.concatenate([spline.knots[:-end], tail]),
        control_points=np.concatenate([spline.control_points, rest]),
    )
