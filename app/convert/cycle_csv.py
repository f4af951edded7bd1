"""A cycle as a table: one row per sample of its moves, two per rest."""

from __future__ import annotations

import csv
from io import StringIO

from joulepath.optimizer.cycle.cycle_solution import CycleMove, CycleSolution

Row = list[float | str]


def to_cycle_csv(found: CycleSolution) -> str:
    """CSV with the columns t, leg, kind, then q, v, a, tau_motor of every joint, and power.

    Units as in the JSON answer. A rest has its mean power, and no torques: motors or brakes may hold the arm.
    """
    joints = range(1, found.moves[0].planned.arm.robot.nq + 1)
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("q", "v", "a", "tau_motor")
    writer.writerow(["t", "leg", "kind", *(f"{name}{joint}" for name in names for joint in joints), "power"])
    leg = 0
    for move in found.moves:
        writer.writerows(_of_move(move, leg))
        leg, t = leg + 1, move.t0 + move.solution.duration
        rests = (("dwell", move.planned.dwell, move.dwell_energy), ("wait", move.wait, move.wait_energy))
        for kind, length, energy in rests:
            if length > 0:
                writer.writerows(_of_rest(move, leg, kind, t, length, energy / length))
                leg, t = leg + 1, t + length
    return text.getvalue()


def _of_move(move: CycleMove, leg: int) -> list[Row]:
    samples, kind = move.solution.trajectory, move.planned.kind
    table = zip(
        (samples.t + move.t0).tolist(),
        *(getattr(samples, name).tolist() for name in ("q", "v", "a", "tau_motor")),
        samples.power.tolist(),
        strict=True,
    )
    return [[t, leg, kind, *q, *v, *a, *tau, power] for t, q, v, a, tau, power in table]


def _of_rest(move: CycleMove, leg: int, kind: str, t: float, length: float, power: float) -> list[Row]:
    q = move.solution.goal.q.tolist()
    still: Row = [0.0] * len(q)
    return [[at, leg, kind, *q, *still, *still, *[""] * len(q), power] for at in (t, t + length)]
