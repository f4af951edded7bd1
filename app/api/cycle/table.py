"""A cycle as a table: one row per sample of its moves, two per rest."""

from __future__ import annotations

from collections.abc import Iterator

from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.result.cycle import LegReport

Row = list[float | str]


def cycle_rows(found: CycleSolution) -> Iterator[Row]:
    """Rows with the columns t, leg, kind, then q, v, a, tau_motor of every joint, and power.

    Units as in the JSON answer. A rest has its mean power, and no torques: motors or brakes may
    hold the arm.
    """
    joints = range(1, found.moves[0].planned.arm.robot.nq + 1)
    names = ("q", "v", "a", "tau_motor")
    yield ["t", "leg", "kind", *(f"{name}{joint}" for name in names for joint in joints), "power"]
    legs = ((move, leg) for move in found.moves for leg in move.legs(found.objective))
    for number, (move, leg) in enumerate(legs):
        rests = leg.kind in ("dwell", "wait")
        yield from _of_rest(leg, number) if rests else _of_move(move, number)


def _of_move(move: CycleMove, number: int) -> list[Row]:
    samples, kind = move.solution.trajectory, move.planned.kind
    table = zip(
        (samples.t + move.t0).tolist(),
        *(getattr(samples, name).tolist() for name in ("q", "v", "a", "tau_motor")),
        samples.power.tolist(),
        strict=True,
    )
    return [[t, number, kind, *q, *v, *a, *tau, power] for t, q, v, a, tau, power in table]


def _of_rest(leg: LegReport, number: int) -> list[Row]:
    q, power = leg.goal.q.tolist(), leg.electrical / leg.duration
    still: Row = [0.0] * len(q)
    ends = (leg.t0, leg.t0 + leg.duration)
    return [[t, number, leg.kind, *q, *still, *still, *[""] * len(q), power] for t in ends]
