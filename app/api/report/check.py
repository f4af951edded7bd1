"""The checks of `joulepath check`: consistency of a report, and agreement with a new answer."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import orjson

from joulepath.app.api.advice.answered import answered
from joulepath.app.api.advice.request import AnsweredRequest
from joulepath.app.api.advice.task import advised
from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle, attached_to
from joulepath.app.api.report.job_rows import answered as answered_rows
from joulepath.app.api.report.job_rows import summed
from joulepath.app.api.report.page import page
from joulepath.app.api.report.placed import of_cycle, rows_at
from joulepath.app.api.report.programs import program_of, program_of_motion
from joulepath.app.api.report.request import JOB_DEADLINE
from joulepath.app.api.report.task import evaluation_of
from joulepath.app.convert.items import given
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.export.certified import certified
from joulepath.optimizer.export.program import Move
from joulepath.optimizer.result.energy import ENERGY_PARTS

Json = dict[str, Any]
RECOMPUTED_TOLERANCE = 1e-3
"""Relative difference of an energy and the same one computed from its motion."""
ANSWER_TOLERANCE = 5e-3
"""Relative difference of the energies of two answers on different machines."""
SUM_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Line:
    """One check."""

    what: str
    found: str
    agrees: bool


@dataclass(frozen=True)
class Checked:
    """All checks; `agrees` if all of them passed."""

    lines: tuple[Line, ...]

    @property
    def agrees(self) -> bool:
        """Whether everything agrees."""
        return all(line.agrees for line in self.lines)


@dataclass(frozen=True)
class CheckTask:
    """A report in HTML or PDF; with `again`, its requests are answered again."""

    file: bytes
    again: bool
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The lines as JSON, see `checked`. `deadline` is not watched: each request has its own."""
        found = checked(self.file, self.again, self.request_id)
        return TaskResult.of_json([vars(line) for line in found.lines])


def checked(file: bytes, again: bool, request_id: str) -> Checked:
    """The checks of a report in HTML or PDF; with `again`, the requests are answered again.

    Raises NoReport, NotCertified, and the errors of answering.
    """
    bundle = attached_to(file)
    lines = [*_motions(bundle), *_sums(bundle)]
    if not file.startswith(b"%PDF"):
        same = page(report_of(bundle), bundle) == file
        words = "agrees with its documents" if same else "differs from its documents"
        lines.append(Line("page", words, same))
    if again:
        lines += _again(bundle, request_id)
    return Checked(tuple(lines))


def _motions(bundle: Bundle) -> list[Line]:
    """The certificates and the energies of all moves, from their splines alone."""
    moves = list[tuple[str, Move, Json]]()
    if bundle.kind == "job":
        for row in answered_rows(bundle.moves):
            if "trajectory" in row["answer"]:
                program = program_of_motion(row["request"], row["answer"])
                certified(program)
                moves.append((f"no. {row['index'] + 1}", program.moves[0], row["answer"]))
    elif bundle.kind == "placement":
        for row in bundle.moves:
            moves += [
                (f"{label} at the {row['place']} place", move, answer)
                for label, move, answer in _moves_of(of_cycle(bundle, row))
            ]
    elif bundle.kind != "evaluate":
        moves = _moves_of(bundle)
    lines = list[Line]()
    for label, move, answer in moves:
        electrical = answer["energy"]["electrical"]
        stated = electrical["total"] - electrical["dwell"]
        found = Plant(move.arm).energy(move.spline).electrical.total
        lines.append(_line(f"energy of {label}", stated, found, RECOMPUTED_TOLERANCE))
    return [Line("limits", f"{len(lines)} motions certified again", True), *lines] if lines else []


def _moves_of(bundle: Bundle) -> list[tuple[str, Move, Json]]:
    """The moves of a motion or a cycle, certified again, by their labels."""
    program = program_of(bundle)
    certified(program)
    return [
        (move.label, move, answer)
        for move, answer in zip(program.moves, bundle.motions, strict=True)
    ]


def _placed_sums(bundle: Bundle) -> Iterator[Line]:
    """The cycles of a placement, and the energies of its places as sums of them."""
    for row in bundle.moves:
        for line in _sums(of_cycle(bundle, row)):
            yield replace(line, what=f"{line.what} at the {row['place']} place")
    objective = bundle.answer["objective"]
    for place in dict.fromkeys(row["place"] for row in bundle.moves):
        parts = (
            row["weight"] * row["answer"]["energy"][objective]["total"]
            for row in rows_at(bundle, place)
        )
        stated = bundle.answer[place]["energy"]
        yield _sum(f"cycles at the {place} place", stated, parts, SUM_TOLERANCE)


def _sums(bundle: Bundle) -> Iterator[Line]:
    """Totals agree with their parts, legs, rows or segments."""
    if bundle.kind == "placement":
        yield from _placed_sums(bundle)
        return
    if bundle.kind == "evaluate":
        total, segments = bundle.answer["total"], bundle.answer["segments"]
        if segments:
            yield _sum(
                "segments", _electrical(total), map(_electrical, segments), RECOMPUTED_TOLERANCE
            )
        return
    total = bundle.answer["energy"]["electrical"]["total"]
    if bundle.kind == "optimize":
        parts = bundle.answer["energy"]["electrical"]
        yield _sum("parts", total, (parts[name] for name in ENERGY_PARTS), RECOMPUTED_TOLERANCE)
    elif bundle.kind == "cycle":
        yield _sum(
            "legs", total, (leg["electrical"] for leg in bundle.answer["legs"]), SUM_TOLERANCE
        )
    else:
        own = summed(bundle.moves)["energy"]["electrical"]["total"]
        yield _line("sum of the rows", total, own, SUM_TOLERANCE)


def _electrical(part: Json) -> float:
    return float(part["energy"]["electrical"]["total"])


def _again(bundle: Bundle, request_id: str) -> Iterator[Line]:
    """The requests, answered anew."""
    if bundle.kind == "job":
        for row in answered_rows(bundle.moves):
            what = f"no. {row['index'] + 1} answered again"
            yield _anew(row["kind"], row["request"], row["answer"], request_id, what)
    elif bundle.kind == "placement":
        for row in bundle.moves:
            if row["request"] is not None:
                what = f"cycle at the {row['place']} place, answered again"
                yield _anew("cycle", row["request"], row["answer"], request_id, what)
    elif bundle.kind != "evaluate":
        what = "request answered again"
        yield _anew(bundle.kind, bundle.request, bundle.answer, request_id, what)
        yield from _advised_anew(bundle)
    else:
        yield from _read_again(bundle, request_id)


def _read_again(bundle: Bundle, request_id: str) -> Iterator[Line]:
    """The log, read and evaluated anew."""
    asked = EvaluateRequest.model_validate_json(orjson.dumps(bundle.request))
    if bundle.log is None:
        found = evaluation_of(asked, request_id, JOB_DEADLINE)
    else:
        body = base64.b64decode(bundle.log["body"])
        log = GivenLog(bundle.request["log"], bundle.log["settings"], body)
        with given({("log", log.id): log}):
            found = evaluation_of(asked, request_id, JOB_DEADLINE)
    for name in ("predicted", "electrical", "by_efforts"):
        stated, own = (
            _electrical(each["total"])
            if name == "predicted"
            else (each["total"]["measured"] or {}).get(name)
            for each in (bundle.answer, found)
        )
        if stated is not None and own is not None:
            words = {"electrical": "measured from power", "by_efforts": "measured from efforts"}
            yield _line(f"{words.get(name, name)}, again", stated, own, RECOMPUTED_TOLERANCE)


def _anew(kind: str, request: Json, answer: Json, request_id: str, what: str) -> Line:
    asked = AnsweredRequest.model_validate_json(orjson.dumps({kind: request}))
    assert asked.task is not None
    found, _ = answered(asked, request_id, asked.task.deadline)
    objective = answer["objective"]
    stated, own = (each["energy"][objective]["total"] for each in (answer, found))
    return _line(what, stated, own, ANSWER_TOLERANCE)


def _advised_anew(bundle: Bundle) -> Iterator[Line]:
    """The changes, computed anew."""
    known = bundle.advised
    if known is None or not known["advice"]:
        return
    task = AnsweredRequest.model_validate_json(orjson.dumps({bundle.kind: bundle.request})).task
    assert task is not None
    found = advised(task, bundle.answer, bundle.moves, bundle.period, NEVER)
    energies = {each.name: each.energy for each in found.advice}
    for each in known["advice"]:
        own = energies.get(each["name"], math.nan)
        yield _line(f"{each['name']} computed again", each["energy"], own, ANSWER_TOLERANCE)


def _sum(what: str, stated: float, parts: Any, tolerance: float) -> Line:
    return _line(f"sum of the {what}", stated, sum(parts), tolerance)


def _line(what: str, stated: float, found: float, tolerance: float) -> Line:
    agrees = abs(found - stated) <= tolerance * max(abs(stated), 1e-3)
    return Line(what, f"{found:.6g} J, stated {stated:.6g} J", agrees)
