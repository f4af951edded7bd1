"""The checks of `joulepath check`: consistency of a report, and agreement with a new answer."""

from __future__ import annotations

from dataclasses import dataclass

import orjson

from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle, attached_to
from joulepath.app.api.report.page import page
from joulepath.app.api.report.request import ReportRequest
from joulepath.app.api.report.task import answer_of, program_of
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.export.certified import certified

ENERGY_TOLERANCE = 1e-3
"""Relative difference of an energy and the same one computed from its motion."""
ANSWER_TOLERANCE = 5e-3
"""Relative difference of the energies of two answers on different machines."""
ROUNDING = 1e-9


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


def checked(file: bytes, again: bool, request_id: str) -> Checked:
    """The checks of a report in HTML or PDF; with `again`, the request is answered anew.

    Raises NoReport, NotCertified, and the errors of answering.
    """
    bundle = attached_to(file)
    lines = [*_motions(bundle), _sum(bundle)]
    if not file.startswith(b"%PDF"):
        same = page(report_of(bundle, program_of(bundle)), bundle) == file
        words = "is what its documents give" if same else "is not what its documents give"
        lines.append(Line("page", words, same))
    if again:
        lines.append(_again(bundle, request_id))
    return Checked(tuple(lines))


def _motions(bundle: Bundle) -> list[Line]:
    """The certificates and the energies of all moves, from their splines alone."""
    program = program_of(bundle)
    certified(program)
    lines = list[Line]()
    for move, answer in zip(program.moves, bundle.motions, strict=True):
        electrical = answer["energy"]["electrical"]
        stated = electrical["total"] - electrical["dwell"]
        found = Plant(move.arm).energy(move.spline).electrical.total
        lines.append(_line(f"energy of {move.label}", stated, found, ENERGY_TOLERANCE))
    return [Line("limits", f"{len(lines)} motions certified again", True), *lines]


def _sum(bundle: Bundle) -> Line:
    """Totals of the cycle, its legs and their answers agree."""
    total = bundle.answer["energy"]["electrical"]["total"]
    if bundle.kind == "optimize":
        parts = bundle.answer["energy"]["electrical"]
        names = ("idle", "potential", "kinetic", "friction", "copper", "inverter", "braking")
        signed = sum(parts[name] for name in (*names, "storage_loss", "dwell"))
        return _line("sum of the parts", total, signed - parts["recovered"], ENERGY_TOLERANCE)
    return _line(
        "sum of the legs",
        total,
        sum(leg["electrical"] for leg in bundle.answer["legs"]),
        ROUNDING,
    )


def _again(bundle: Bundle, request_id: str) -> Line:
    """The request, answered anew."""
    asked = ReportRequest.model_validate_json(orjson.dumps({bundle.kind: bundle.request}))
    result = answer_of(asked, request_id, asked.deadline)
    objective = bundle.answer["objective"]
    stated, found = (
        each["energy"][objective]["total"]
        for each in (bundle.answer, orjson.loads(result.document))
    )
    return _line("request answered anew", stated, found, ANSWER_TOLERANCE)


def _line(what: str, stated: float, found: float, tolerance: float) -> Line:
    agrees = abs(found - stated) <= tolerance * max(abs(stated), 1e-3)
    return Line(what, f"{found:.6g} J, stated {stated:.6g} J", agrees)
