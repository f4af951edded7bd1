"""A report as a stand-alone HTML page."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable
from importlib.resources import files
from string import Template

from joulepath.app.api.report.bundle import Bundle, in_html
from joulepath.app.api.report.report import (
    Assumption,
    Change,
    Cost,
    Fact,
    Part,
    Report,
    Rival,
    Table,
)

MEDIA_TYPE = "text/html; charset=utf-8"
_STRONG = re.compile(r"\*([^*]+)\*")
_CODE = re.compile(r"`([^`]+)`")


def page(report: Report, bundle: Bundle) -> bytes:
    """The page, with the documents of the report in it."""
    template = Template(
        (files("joulepath.app") / "static/report/report.html").read_text(encoding="utf-8")
    )
    return template.substitute(
        title=escape(report.title),
        subtitle=escape(report.subtitle),
        lead=" ".join(_rich(each) for each in report.lead),
        facts="".join(map(_fact, report.facts)),
        figure=_figure(report),
        rivals=_section(report.rivals_title, _rows(map(_rival, report.rivals)), report.rivals_note),
        parts=_section("Where the energy goes", _rows(map(_part, report.parts))),
        course=_course(report),
        costs=_costs(report),
        changes=_section(
            "Changes that save energy",
            _rows(map(_change, report.changes)) if report.changes else "",
            report.changes_note,
        ),
        proven=_section(report.proven_title, f"<p>{_rich(report.proven)}</p>"),
        check=_section("How to verify this report", f"<p>{_rich(report.check)}</p>"),
        assumptions=_section(
            "Assumptions and their trust letters",
            f"<table>{''.join(map(_assumption, report.assumptions))}</table>",
            report.assumptions_note,
        ),
        table="" if report.table is None else _table(report.table),
        foot=escape(report.foot),
        attached=in_html(bundle.packed()),
    ).encode()


def _section(title: str, content: str, note: str = "") -> str:
    """A part of the page; without content, none."""
    if not content:
        return ""
    below = f'<p class="note">{_rich(note)}</p>' if note else ""
    return f"<h2>{escape(title)}</h2>{content}{below}"


def _rows(rows: Iterable[str]) -> str:
    return f'<table class="tight">{"".join(rows)}</table>'


def _figure(report: Report) -> str:
    if not report.picture:
        return ""
    caption = f"<figcaption>{_rich(report.caption)}</figcaption>"
    return f'<figure aria-label="The cell">{report.picture}{caption}</figure>'


def _course(report: Report) -> str:
    if not report.course:
        return ""
    head = f"<h2>{escape(report.course_title)}</h2>"
    note = f'<p class="note">{_rich(report.course_note)}</p>'
    return f'<section class="course">{head}{note}{report.course}</section>'


def _costs(report: Report) -> str:
    if not report.costs:
        return ""
    cells = "".join(f"<td>{escape(each)}</td>" for each in ("", "kWh", report.currency, "kg CO2e"))
    rows = "".join(map(_cost, report.costs))
    table = f"<table><thead><tr>{cells}</tr></thead><tbody>{rows}</tbody></table>"
    return _section("Energy costs", table, report.costs_note)


def _table(table: Table) -> str:
    head = "".join(f'<th scope="col">{escape(each)}</th>' for each in table.head)
    rows = "".join(f"<tr>{_cells(table, row)}</tr>" for row in table.rows)
    whole = f'<table class="rows"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    scroll = f'<div class="scroll" role="region" aria-label="Table" tabindex="0">{whole}</div>'
    content = _section(table.title, scroll, table.note)
    return f'<section class="table words{table.words}">{content}</section>'


def _cells(table: Table, row: tuple[str, ...]) -> str:
    """The cells of a row; the last one is a remark if there are fewer than in the head."""
    *cells, last = row
    left = len(table.head) - len(cells)
    remark = f' colspan="{left}" class="remark"' if left > 1 else ""
    return "".join(f"<td>{escape(each)}</td>" for each in cells) + (
        f"<td{remark}>{escape(last)}</td>"
    )


def escape(text: str, quote: bool = True) -> str:
    """The text for a page, with its subscript."""
    return html.escape(text, quote).replace("CO2e", "CO₂e")


def _rich(text: str) -> str:
    """The text with its important words and its code."""
    return _CODE.sub(r"<code>\1</code>", _STRONG.sub(r"<b>\1</b>", escape(text, quote=False)))


def _fact(fact: Fact) -> str:
    return (
        f'<div class="fact"><p><strong>{escape(fact.value)}</strong> {escape(fact.unit)}</p>'
        f"<p>{escape(fact.words)}</p></div>"
    )


def _rival(rival: Rival) -> str:
    kind = "ours" if rival.ours else ("claimed" if rival.claimed else "broken")
    kind += " saves" if rival.saves else ""
    time = escape(rival.time).replace(" ", "&nbsp;")
    return (
        f'<tr class="{kind}"><th scope="row">{escape(rival.name)} <small>{time}</small></th>'
        f'<td class="bar"><span style="width:{100 * rival.share:.1f}%"></span></td>'
        f"<td>{escape(rival.energy)}</td><td>{escape(rival.verdict)}</td></tr>"
    )


def _part(part: Part) -> str:
    return (
        f'<tr><th scope="row"><i style="background:{part.colour}"></i>{escape(part.name)}</th>'
        f"<td>{escape(part.energy)}</td><td>{escape(part.share)}</td></tr>"
    )


def _cost(cost: Cost) -> str:
    cells = "".join(f"<td>{escape(each)}</td>" for each in (cost.energy, cost.money, cost.carbon))
    return f'<tr><th scope="row">{escape(cost.period)}</th>{cells}</tr>'


def _change(each: Change) -> str:
    cells = "".join(f"<td>{escape(cell)}</td>" for cell in (each.energy, each.saving, each.yearly))
    return f'<tr class="claimed"><th scope="row">{escape(each.what)}</th>{cells}</tr>'


def _assumption(each: Assumption) -> str:
    return (
        f'<tr><td class="letter">{escape(each.letter)}</td><th scope="row">{escape(each.what)}</th>'
        f"<td>{escape(each.source)}</td></tr>"
    )
