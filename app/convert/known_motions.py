"""Known motions in the form of the database: compressed JSON."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import orjson

from joulepath.app.convert.packed import packed, unpacked
from joulepath.optimizer.cycle.known_motions import KnownMotion, KnownMotions
from joulepath.optimizer.motion.spline import Spline

_SPLINE = ("degree", "knots", "control_points")


def to_known_motions(kept: Mapping[str, bytes]) -> KnownMotions:
    """Known motions from the database."""
    return KnownMotions(
        {key: _to_motion(orjson.loads(unpacked(body))) for key, body in kept.items()}
    )


def to_kept(motions: KnownMotions) -> dict[str, bytes]:
    """Used or found motions in the form of the database."""
    return {key: _kept(motion) for key, motion in motions.used.items()}


def _to_motion(kept: dict[str, object]) -> KnownMotion:
    degree, knots, points = (kept[name] for name in _SPLINE)
    assert isinstance(degree, int)
    spline = Spline(degree, np.array(knots), np.array(points))
    return KnownMotion(spline, kept["stationarity"])  # type: ignore[arg-type]


def _kept(motion: KnownMotion) -> bytes:
    spline = {name: np.ascontiguousarray(getattr(motion.spline, name)) for name in _SPLINE[1:]}
    own = {"degree": motion.spline.degree, **spline, "stationarity": motion.stationarity}
    return packed(orjson.dumps(own, option=orjson.OPT_SERIALIZE_NUMPY))
