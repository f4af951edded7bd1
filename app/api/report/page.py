"""A report as a stand-alone HTML page."""

from __future__ import annotations

import html
import re
from importlib.resources import files
from string import Template

from joulepath.app.api.report.bundle import Bundle, in_html
from joulepath.app.api.report.report import Assumption, Cost, Fact, Part, Report, Rival

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
        picture=report.picture,
        caption=_rich(report.caption),
        rivals="".join(map(_rival, report.rivals)),
        rivals_note=_rich(report.rivals_note),
        parts="".join(map(_part, report.parts)),
        course_title=escape(report.course_title),
        course_note=_rich(report.course_note),
        course=report.course,
        costs="".join(map(_cost, report.costs)),
        currency=escape(report.currency),
        costs_note=_rich(report.costs_note),
        proven=_rich(report.proven),
        check=_rich(report.check),
        assumptions="".join(map(_assumption, report.assumptions)),
        assumptions_note=_rich(report.assumptions_note),
        foot=escape(report.foot),
        attached=in_html(bundle.packed()),
    ).encode()


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


def _assumption(each: Assumption) -> str:
    return (
        f'<tr><td class="letter">{escape(each.letter)}</td><th scope="row">{escape(each.what)}</th>'
        f"<td>{escape(each.source)}</td></tr>"
    )
