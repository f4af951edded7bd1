"""The report of a job: its sums on the first page, then a table of its motions and cycles."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.costs import Money, cost_table, costs_note, facts
from joulepath.app.api.report.drawings import Bar, drawn_bars
from joulepath.app.api.report.job_rows import answered, rivals_of
from joulepath.app.api.report.numbers import (
    counted,
    digits,
    down,
    percent,
    share,
    unbroken,
    unmarked,
    up,
)
from joulepath.app.api.report.programs import program_of_motion
from joulepath.app.api.report.report import Report, Rival, Table
from joulepath.app.api.report.rivals import (
    REPORT,
    above_least,
    limits_used,
    nearest_rival,
    parts_of,
    rival_name,
    saved,
    their_energy,
)
from joulepath.app.convert.given_answer import arm_of
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.picture.cell_picture import cell_picture

Json = dict[str, Any]
_NEAREST = "Best baseline of each move"


def job_report(bundle: Bundle) -> Report:
    """The report of the rows of a job. Raises InvalidProblem without a motion of one robot."""
    rows = answered(bundle.moves)
    motions = [row for row in rows if "trajectory" in row["answer"]]
    if not motions or len({row["answer"]["robot"] for row in rows}) > 1:
        raise InvalidProblem(
            "job",
            "A report needs a job with motions, all of one robot; this job has no motion, or has "
            "several robots.",
        )
    electrical, money = bundle.answer["energy"]["electrical"], Money.of(bundle)
    most = max(motions, key=_joules)
    shown = program_of_motion(most["request"], most["answer"])
    masses = [arm_of(row["request"], row["answer"]).payload.mass for row in motions]
    return Report(
        title=bundle.title or bundle.request.get("name") or "Energy of a job",
        subtitle=bundle.subtitle(shown.robot),
        lead=tuple(map(unbroken, _lead(bundle))),
        facts=facts(bundle, money),
        picture=cell_picture(shown),
        caption=f"The move that needs the most energy: {_name(most)}, {digits(_joules(most))} J. "
        "The picture shows the bodies of the collision check: the arm at the goal and at the start "
        "(pale).",
        rivals_title="Comparison with baselines",
        rivals=_rivals(bundle),
        rivals_note="The saving and the bar of each baseline compare only the moves in which it "
        "keeps every limit, in the same time. No saving is claimed in the other moves.",
        parts=parts_of(electrical),
        course_title="Energy of each move",
        course_note="In J, in the order of the table, with 90 % intervals.",
        course=drawn_bars(
            [Bar.of(str(row["index"] + 1), row["answer"]["energy"]["electrical"]) for row in rows]
        ),
        costs=cost_table(bundle, money),
        currency=money.currency,
        costs_note=f"A run consists of every move of the table once. {costs_note(money)}",
        proven_title="Certificate",
        proven=unbroken(_proven(rows)),
        check=bundle.how_to_check(None),
        assumptions=assumptions(most["request"], bundle.costs, shown.robot, masses),
        assumptions_note=unbroken(interval_note(electrical.get("interval"))),
        foot=bundle.foot,
        table=_table(bundle.moves),
    )


def _joules(row: Json) -> float:
    return float(row["answer"]["energy"]["electrical"]["total"])


def _moves(count: int) -> str:
    return counted(count, "move")


def _name(row: Json) -> str:
    return unmarked(row["name"] or f"no. {row['index'] + 1}")


def _lead(bundle: Bundle) -> tuple[str, ...]:
    rows, answer = answered(bundle.moves), bundle.answer
    total = answer["energy"]["electrical"]["total"]
    first = (
        f"{_moves(len(rows))} need{'s' if len(rows) == 1 else ''} *{digits(total)} J* in total, "
        f"in {digits(answer['duration'])} s of motion"
    )
    count, theirs, ours = rivals_of(rows).get("nearest", (0, 0.0, 0.0))
    claim = (
        ". No baseline keeps every limit, so no saving is claimed."
        if not count
        else f". In the {_moves(count)} with a baseline within all limits, the optimised motions "
        f"need {_against(saving(ours, theirs))} the best of these baselines in the same time."
    )
    left = [row for row in bundle.moves if row["answer"] is None]
    have = "has" if len(left) == 1 else "have"
    others = f" {len(left):,} of {len(bundle.moves):,} moves {have} no answer." if left else ""
    bound = answer["energy"]["lower_bound"]
    least = above_least("No set of motions for these moves", total, bound)
    return first + claim, least + others


def _against(saving: float) -> str:
    if abs(saving) < REPORT.equal:
        return "as much as"
    return f"*{percent(saving)} less* than" if saving > 0 else f"{percent(-saving)} more than"


def _rivals(bundle: Bundle) -> tuple[Rival, ...]:
    found = rivals_of(bundle.moves)
    total = bundle.answer["energy"]["electrical"]["total"]
    ratios = {name: share(theirs, ours) for name, (_, theirs, ours) in found.items()}
    most = max([1.0, *ratios.values()])
    own = Rival(
        "Optimised motions",
        _moves(len(answered(bundle.moves))),
        f"{digits(total)} J",
        1 / most,
        "",
        True,
        ours=True,
    )
    return (
        own,
        *(
            Rival(
                _NEAREST if name == "nearest" else rival_name({"name": name}),
                _moves(count),
                f"{digits(theirs)} J",
                max(ratios[name], 0.0) / most,
                saved(saving(ours, theirs)),
                True,
                saves=saving(ours, theirs) >= REPORT.equal,
            )
            for name, (count, theirs, ours) in sorted(
                found.items(), key=lambda each: (each[0] != "nearest", -each[1][0])
            )
        ),
    )


def _proven(rows: list[Json]) -> str:
    certificates = [row["answer"]["certificate"] for row in rows]
    worst = dict[str, float | None]()
    for each in certificates:
        for name, value in each["worst_ratio"].items():
            worst[name] = max(
                (known for known in (worst.get(name), value) if known is not None), default=None
            )
    checked = [
        (each["clearance"]["min_clearance"], row)
        for each, row in zip(certificates, rows, strict=True)
        if each.get("clearance") is not None
    ]
    every = f"all {_moves(len(rows))}" if len(rows) > 1 else "the move"
    sentences = [f"All limits are kept in {every}. {limits_used(worst)}"]
    if checked:
        least, row = min(checked, key=lambda each: float(each[0]))
        sentences.append(
            f"All bodies keep at least {down(1e3 * least, 2)} mm more than the required clearance "
            f"at every instant; the nearest are those in {_name(row)}."
        )
    if len(checked) < len(rows):
        unchecked = _moves(len(rows) - len(checked))
        sentences.append(f"Collisions were not checked in {unchecked}.")
    error = max(each["energy_error"] for each in certificates)
    sentences.append(
        "A computation with Pinocchio, independent of the solver, gives the same energies within "
        f"{up(100 * error, 1)} %."
    )
    return " ".join(sentences)


def _table(rows: list[Json]) -> Table:
    return Table(
        title="Moves",
        note="Interval: from the 5th to the 95th percentile. Baseline: the best baseline within "
        "all limits, in the same time. Lower bound: no motion needs less.",
        head=(
            "no.",
            "move",
            "kg",
            "s",
            "J",
            "interval, J",
            "baseline, J",
            "saving",
            "lower bound, J",
        ),
        rows=tuple(map(_cells, rows)),
        words=2,
    )


def _cells(row: Json) -> tuple[str, ...]:
    head, answer = (str(row["index"] + 1), row["name"] or ""), row["answer"]
    if answer is None or not answered([row]):
        problem = row["problem"] or {}
        why = problem.get("detail") or problem.get("title")
        return (*head, why or ("no motion" if answer is not None else row["state"]))
    electrical = answer["energy"]["electrical"]
    known, nearest = electrical.get("interval"), nearest_rival(answer)
    mass = ((row["request"].get("payload") or {}).get("mass")) or 0.0
    ours = _joules(row) if answer["objective"] == "electrical" else None
    return (
        *head,
        digits(mass) if mass else "–",
        digits(answer["duration"]),
        digits(electrical["total"]),
        "" if known is None else f"{down(known['p5'])} to {up(known['p95'])}",
        "–" if nearest is None or ours is None else digits(their_energy(ours, nearest["saving"])),
        "–" if nearest is None else percent(nearest["saving"]),
        down(answer["energy"]["lower_bound"]),
    )
