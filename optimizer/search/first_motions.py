"""Which candidates are worth a solve for mechanical work: the first motion of each tells them apart.

The lower bound of mechanical work is much the same for all full turns of a branch. It rules few of them out, and every
solve takes ten milliseconds. A solve starts from the smoothed time-optimal motion. Its work in the longest allowed
duration is found for all candidates at once, in less time than one solve takes. It foretells their order: in 14 random
moves to a pose, the candidate of the answer was among the first six, and its first motion needed at most 1.2 times the
least work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.methods.free_spline import COARSE, smoothed
from optimizer.nlp.coordinates import Coordinates
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LONGEST_DURATION
from optimizer.search.candidates import Candidate
from optimizer.trajectories import bspline

# a candidate is not solved if its first motion needs more than this ratio of the work that a solved one needs for
# its own, or if so many solved ones need less
HOPELESS, MOST = 1.5, 10


@dataclass(frozen=True)
class FirstMotions:
    """Mechanical work [J] of the first motions of a search's candidates, by `id` of the candidate."""

    candidates: Sequence[Candidate]
    work: dict[int, float]

    @staticmethod
    def of(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> FirstMotions:
        """The first motions of candidates."""
        points = np.array([_guess(prepared, each) for each in candidates])
        return FirstMotions(candidates, dict(zip(map(id, candidates), _works(prepared, points).tolist(), strict=True)))

    def of_candidate(self, candidate: Candidate) -> float:
        """The work [J] of a candidate's first motion."""
        return self.work[id(candidate)]

    def are_better(self, candidate: Candidate) -> bool:
        """Whether solved candidates leave this one no hope.

        A motion around obstacles may need more work than the first motion of its candidate: then its own work counts.
        """
        solved = [(self.of_candidate(each), each.energy) for each in self.candidates if each.energy is not None]
        own = self.of_candidate(candidate)
        least = min((max(first, found) for first, found in solved), default=np.inf)
        return own > HOPELESS * least or sum(first <= own for first, _ in solved) >= MOST


def _guess(prepared: PreparedProblem, candidate: Candidate) -> Array:
    """Control points (COARSE, nq) [rad] of the motion that a solve of the candidate starts from."""
    line = Coordinates.joints(candidate.q_start, candidate.q_goal, prepared.arm.active_limits)
    return smoothed(bspline.uniform(COARSE), line)


def _works(prepared: PreparedProblem, points: Array) -> Array:
    """Mechanical work (n,) [J] of motions with control points (n, COARSE, nq) in the longest allowed duration."""
    space, longest = bspline.uniform(COARSE), prepared.problem.duration_max or LONGEST_DURATION
    q, v, a = np.einsum("dkm,cmj->dckj", space.at_nodes, points, optimize=True)
    v, a = v / longest, a / longest**2
    tau = prepared.torques(*(each.reshape(-1, each.shape[-1]) for each in (q, v, a))).reshape(v.shape)
    return np.asarray(longest * np.abs(tau * v).sum(axis=-1) @ space.weights)
