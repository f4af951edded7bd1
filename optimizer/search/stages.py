"""Stages of a search: functions on the search state, listed in order by `METHOD`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from joulepath.optimizer.bounds.missed_branches import all_branches_known
from joulepath.optimizer.deadline import DeadlinePassed, checkpoint, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.spline import Spline, resting_until
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem, narrowed
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search import free_goal, self_motions
from joulepath.optimizer.search.answer import answer
from joulepath.optimizer.search.baseline_comparison import baselines_of, compare_with_baselines
from joulepath.optimizer.search.candidates import Reason, pairs
from joulepath.optimizer.search.ends import ends
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.exploration import explore
from joulepath.optimizer.search.fastest import explore_or_find_fastest, find_fastest
from joulepath.optimizer.search.free_members import bounded
from joulepath.optimizer.search.freed_duration import start_from_free_duration
from joulepath.optimizer.search.moving_time import coarse_swing
from joulepath.optimizer.search.no_trajectory import no_motion
from joulepath.optimizer.search.other_ways import explore_other_ways
from joulepath.optimizer.search.outer_turns import families_of
from joulepath.optimizer.search.path_ends import path_candidates
from joulepath.optimizer.search.refinement import refine, refine_rivals
from joulepath.optimizer.search.resting_posture import rest_on_the_way
from joulepath.optimizer.search.sampled_ends import between
from joulepath.optimizer.search.sliding import may_slide
from joulepath.optimizer.search.state import DURATION_TOLERANCE, FoundMotion, SearchState
from joulepath.optimizer.search.tightened_limits import retry_within_tighter_limits
from joulepath.optimizer.search.warm_start import warm_start
from joulepath.optimizer.search.waypoint_baselines import waypoint_baselines
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

Stage = Callable[[SearchState], None]


@dataclass(frozen=True)
class StageSettings:
    """Settings of the stages of a search."""

    storage_share: float = 0.5
    """Share of the time left for the search without energy storage."""


STAGES = StageSettings()


def find_candidates(state: SearchState) -> None:
    """Find all pairs of start and goal configurations."""
    prepared = state.prepared
    if state.problem.tool_path is not None:
        state.candidates = path_candidates(prepared)
        return
    (starts, no_starts), (goals, no_goals) = (ends(prepared, name) for name in ("start", "goal"))
    state.unreachable = no_starts + no_goals
    state.candidates = pairs(prepared, starts, goals)


def bound_candidates(state: SearchState) -> None:
    """Rule out candidates with infeasible ends, and compute the lower bounds of the others."""
    problem = state.problem
    state.candidates = bounded(state.prepared, state.candidates)
    checkpoint()
    least = min(candidate.shortest for candidate in state.candidates)
    state.longest = max(least, problem.duration_min or 0.0)
    problem.arm.check_rating("payload.mass", problem.arm.payload.mass)
    is_complete = all_branches_known(problem) and not any(each.sampled for each in state.candidates)
    if is_complete and not problem.tool_path:
        state.proven = min(each.lower_bound for each in state.candidates)
    state.tell_candidates()


def start_from_known_motions(state: SearchState) -> None:
    """Solve the candidates of known motions from these motions."""
    for spline in state.known:
        warm_start(state, spline)


def solve_without_storage(state: SearchState) -> None:
    """Solve the problem without energy storage: with it, no motion needs more energy."""
    if state.uses_storage:
        arm = replace(state.problem.arm, bus=Bus())
        state.without_storage = solve_related(
            state, replace(state.problem, arm=arm), share=STAGES.storage_share
        )


def explore_candidates(state: SearchState) -> None:
    """Solve candidates by their bounds; take the fastest motion if no motion is short enough."""
    explore_or_find_fastest(state, lambda: explore(state), state.known, state.without_storage)


def refine_sampled_ends(state: SearchState) -> None:
    """Move the ends of the best samples over their targets."""
    if state.method.most_solved is None:
        state.candidates += free_goal.refine_goals(state) + self_motions.refine(state)
        state.tell_candidates()
        state.tell_best()


def refine_best(state: SearchState) -> None:
    """Refine the incumbent, and candidates with sliding ends that may become better."""
    best = state.best()
    if best is None or best.refused:
        return
    rest_on_the_way(state, best)
    coarse = best.energy or 0.0
    refine(state, best)
    refine_rivals(state, best, coarse)
    start_from_free_duration(state, state.best() or best)


def solve_other_durations(state: SearchState) -> None:
    """Compare with motions of least mechanical work of other durations, once.

    Rest does no work. A motion may therefore be shorter than a fixed duration, and rest for the
    remaining time. A free duration may be the longest one, although the NLP's smoothed work is
    positive at rest, and solves with a free duration end too early. Searches with a free and with
    a fixed duration also end in different local minima.
    """
    problem, best = state.problem, state.best()
    is_sought = problem.objective == "mechanical"
    if not is_sought or state.other_durations_solved or best is None:
        return
    state.other_durations_solved, longest = True, problem.duration_max
    if not problem.has_fixed_duration:
        _accept(state, solve_related(state, replace(problem, duration_min=longest)))
    elif problem.may_rest and families_of(state):
        # between sliding ends, the search for a free duration found nothing better
        _accept(state, solve_related(state, replace(problem, duration_min=None)))
    swing = coarse_swing(state, state.best() or best) if problem.may_rest else None
    if swing is None:
        return
    time = swing.spline.duration
    given = replace(problem, duration_min=time, duration_max=time)
    # the coarse motion starts a second search only if the first finds nothing better: as the
    # incumbent, it would prune motions that need less work after their corners are sharp
    for known in ((), (swing.spline,)):
        found = solve_related(state, given, known=known)
        _accept(state, found)
        if found is not None and found.energy.mechanical.total <= swing.work:
            return


def solve_between_best_ends(state: SearchState) -> None:
    """Compare with the motions between the ends of the best motion as the only targets, once.

    A search to a goal of free orientation shares its solves among all orientations. If the arm
    reaches a pose in any posture, the search to a single pose finds better postures: up to 2 % less
    energy, and up to 26 % less mechanical work. The same holds for the least mechanical work to one
    of several targets.
    """
    problem, best = state.problem, state.best()
    is_able = may_slide(state.prepared) and problem.tool_path is None
    if state.best_ends_searched or best is None or not is_able:
        return
    is_work, is_free = problem.objective == "mechanical", best.goal.tolerance is not None
    targets = best.start.target, best.goal.target
    single = narrowed(problem, *targets)
    if is_free:
        single = replace(single, goal=Pose(tcp_pose(problem.arm, best.q_goal)))
    elif not is_work or (single.start is problem.start and single.goal is problem.goal):
        return
    state.best_ends_searched = True
    # a known motion prunes others, of which some need less work after their corners are sharp
    known = () if is_work else (best.spline,)
    found = solve_related(state, single, known=known, targets=targets)
    _accept(state, found)
    if is_free and found is not None and state.best() is found.candidate:
        better = free_goal.refine_goal(state, found.candidate)
        if better is not found.candidate:
            state.candidates.append(better)
            refine(state, better)


def _accept(state: SearchState, found: FoundMotion | None) -> None:
    """Accept the motion of a related problem if it needs less energy."""
    if found is not None:
        state.accept_if_better(found.candidate, found.result, found.energy)


def compare_best_with_baselines(state: SearchState) -> None:
    """Compute the baselines of the best motion, and start solves from cheaper baselines."""
    best = state.best()
    assert best is not None
    table = compare_with_baselines(state, best)
    best = state.best() or best
    state.baselines = [*table, *waypoint_baselines(state, best, table)]
    # a coarse motion without refinement is no optimum
    state.cut_short |= state.deadline.passed


def confirm_best(state: SearchState) -> None:
    """Make the answer of the best motion; if its certificate fails, solve other candidates."""
    best = state.best()
    assert best is not None
    state.answer = answer(state, best, state.baselines)
    if state.answer is None:
        retry_within_tighter_limits(state, best)
        explore(state)


def until_confirmed(*stages: Stage) -> Stage:
    """A stage to repeat stages until there is an answer, or no motion is left."""

    def repeat(state: SearchState) -> None:
        while state.answer is None and state.best() is not None:
            for stage in stages:
                stage(state)

    return repeat


def confirm_fastest(state: SearchState) -> None:
    """Take the fastest motion if the certificate confirmed no other motion."""
    if state.answer is not None or not any(
        each.reason is Reason.NOT_CONFIRMED for each in state.candidates
    ):
        return
    find_fastest(state, state.known, improve=False)
    best = state.best()
    if best is not None:
        state.answer = answer(state, best, baselines_of(state, best))


PREPARATION: tuple[Stage, ...] = (find_candidates, bound_candidates)
"""Stages before any motion is computed."""

SEARCH: tuple[Stage, ...] = (
    solve_without_storage,
    explore_candidates,
    explore_other_ways,
    refine_sampled_ends,
    until_confirmed(
        refine_best,
        solve_other_durations,
        solve_between_best_ends,
        compare_best_with_baselines,
        confirm_best,
    ),
    confirm_fastest,
)
"""Stages after the candidates are prepared, of which some may be solved."""

METHOD: tuple[Stage, ...] = (*PREPARATION, start_from_known_motions, *SEARCH)
"""All stages of a search, in order."""


def prepare(state: SearchState) -> None:
    """Run the stages before any motion is computed.

    Raises:
        DeadlineExceeded: the deadline passed.
        JoulepathError: errors of `optimize` before the search.
    """
    try:
        with watch(state.end):
            for stage in PREPARATION:
                stage(state)
    except DeadlinePassed:
        raise state.too_late() from None


def search(state: SearchState) -> Solution:
    """Run the stages after the preparation; raises the errors of `optimize`."""
    for stage in SEARCH:
        stage(state)
    if state.answer is not None:
        return state.answer
    raise no_motion(state)


def solve_related(
    state: SearchState,
    problem: Problem,
    share: float = 1.0,
    known: Sequence[Spline] = (),
    targets: tuple[int, int] | None = None,
) -> FoundMotion | None:
    """Solve a related problem; its motions must be feasible in the own problem at no more energy.

    Motions that are too short rest at the goal for the remaining time.

    Args:
        state: state of the search.
        problem: the related problem.
        share: share of the time left for the related search.
        known: motions to start from.
        targets: indices of the own start and goal that the related problem has alone; None if it
            has all of them.

    Returns:
        The motion with its energy in the own problem; None if there is none in time.
    """
    left = state.deadline.left
    if left <= 0:
        return None
    other = SearchState.of(
        replace(problem, bound="normal", deadline=share * left), known, state.clock
    )
    other.other_durations_solved = state.other_durations_solved and targets is None
    other.best_ends_searched = True
    try:
        prepare(other)
        start_from_known_motions(other)
        found = search(other)
    except (DeadlineExceeded, DurationTooShort, NoTrajectory):
        return None
    state.iterations += found.solver.iterations
    state.solves += found.solver.nlp_solves
    targets = targets or (found.start.target, found.goal.target)
    same_targets = [
        each for each in state.candidates if (each.start.target, each.goal.target) == targets
    ]
    candidate = between(state.prepared, state.candidates, found.start.q, found.goal.q, same_targets)
    spline, least = found.trajectory.spline, state.problem.duration_min or 0.0
    # rounding may make a motion of the least duration a little shorter
    if spline.duration < least * (1 - DURATION_TOLERANCE):
        spline = resting_until(spline, least)
    result = SolveResult(
        SolveStatus.SOLVED,
        SolveReason.CONVERGED,
        spline=spline,
        stationarity=found.solver.stationarity,
    )
    return FoundMotion(candidate, result, state.prepared.energy(spline))
