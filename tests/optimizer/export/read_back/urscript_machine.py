"""A small interpreter of URScript, for the statements of the generated programs."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from joulepath.models.robot import Array

SIGNATURES: dict[str, tuple[str, ...]] = {
    # names of the arguments in the maker's script manual, PolyScope 5
    "servoj": ("q", "a", "v", "t", "lookahead_time", "gain"),
    "movej": ("q", "a", "v", "t", "r"),
    "stopj": ("a",),
    "sleep": ("t",),
    "set_payload": ("m", "cog"),
    "get_target_payload": (),
    "get_actual_joint_positions": (),
    "set_standard_digital_out": ("n", "b"),
    "popup": ("s", "title", "warning", "error", "blocking"),
    "norm": ("a",),
}
_STATEMENT = re.compile(
    r"(?P<begins>(def \w+\([\w, ]*\)|while .+|if .+|elif .+|else):)|(?P<end>end)|(?P<halt>halt)"
    r"|(?P<returns>return .+)|((local |global )?(?P<name>[a-z]\w*) = "
    r"(?P<value>.+))|(?P<call>[a-z]\w*\(.*\))"
)
_EXPRESSION = re.compile(r"""^[\w\s.,+\-*/()<>=\[\]'"?:]+$""")


class Halt(Exception):
    """The program stopped itself, with the text of its last popup."""


class Controller:
    """An arm at the last target of servoj or movej, `lag` [rad] behind, with a `payload` [kg] in
    force.

    It records its commands.
    """

    def __init__(
        self, q: Array, lag: float = 0.0, payload: float = 0.0, takes_payload: bool = True
    ) -> None:
        self.q, self.lag, self.payload = np.asarray(q, dtype=float), lag, payload
        self.takes_payload = takes_payload
        self.events: list[tuple[Any, ...]] = []
        self.said, self.clock = "", 0.0

    @property
    def set_points(self) -> Array:
        """All set points of servoj, t [s] and q."""
        return np.array([[event[1], *event[2]] for event in self.events if event[0] == "servoj"])

    def run(self, text: str) -> None:
        """Runs a program. Raises Halt, or SyntaxError for text other than URScript."""
        scope: dict[str, Any] = {"Halt": Halt, "machine": self, "__builtins__": {"range": range}}
        scope |= {name: self._function(name) for name in SIGNATURES}
        exec(translated(text), scope)
        scope["joulepath"]()

    def _function(self, name: str) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            arguments = dict(zip(SIGNATURES[name], given, strict=False)) | named
            assert len(given) <= len(SIGNATURES[name]) and arguments.keys() <= set(SIGNATURES[name])
            return getattr(self, f"_{name}")(**arguments)

        return call

    def _servoj(self, q: list[float], t: float, lookahead_time: float, gain: float) -> None:
        assert 0.03 <= lookahead_time <= 0.2 and 100 <= gain <= 2000
        self.clock += t
        self.q = np.array(q) - self.lag
        self.events.append(("servoj", self.clock, q))

    def _movej(self, q: list[float], a: float, v: float) -> None:
        self.q = np.array(q)
        self.events.append(("movej", v, q))

    def _stopj(self, a: float) -> None:
        self.events.append(("stopj", a))

    def _sleep(self, t: float) -> None:
        self.clock += t
        self.events.append(("sleep", t))

    def _set_payload(self, m: float, cog: list[float]) -> None:
        self.payload = m if self.takes_payload else self.payload
        self.events.append(("payload", m, cog))

    def _get_target_payload(self) -> float:
        return self.payload

    def _get_actual_joint_positions(self) -> list[float]:
        return [float(each) for each in self.q]

    def _set_standard_digital_out(self, n: int, b: bool) -> None:
        self.events.append(("output", n, b))

    def _popup(self, s: str, title: str, warning: bool, error: bool, blocking: bool) -> None:
        self.said = s
        self.events.append(("popup", s))

    @staticmethod
    def _norm(a: float) -> float:
        return abs(a)


def translated(text: str) -> str:
    """The program as Python, line by line. Raises SyntaxError for a line that is no statement of
    URScript.
    """
    lines, depth, globals_ = list[str](), 0, set(re.findall(r"global (\w+) =", text))
    outside = len(lines)
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("#"):
            continue
        found = _STATEMENT.fullmatch(line)
        expression = found and (found["value"] or found["returns"] or found["call"])
        if found is None or (expression and not _EXPRESSION.match(expression)):
            raise SyntaxError(f"line {number}: {line}")
        if found["end"]:
            depth -= 1
            continue
        inner = depth - (1 if line.startswith(("elif", "else")) else 0)
        body = re.sub(r"^(local|global) ", "", line)
        lines.append("  " * inner + ("raise Halt(machine.said)" if found["halt"] else body))
        if found["begins"]:
            depth = inner + 1
            if line.startswith("def "):
                lines.append(
                    "  " * depth + ("global " + ", ".join(sorted(globals_)) if globals_ else "pass")
                )
    if depth != outside:
        raise SyntaxError("a block has no end")
    return "\n".join(lines)
