"""Size of answers of `POST /optimize` over HTTP, by `candidates` and by coding; and the time to compress them.

    python -m benchmarks.answer_sizes

The requests are the first one of the README and examples: two poses, several targets, a path, obstacles.
"""

from __future__ import annotations

import gzip
import http.client
import time
from typing import Any

import orjson
import zstandard

from benchmarks.service import ROOT, running
from joulepath.app.schemas.examples.optimize import OPTIMIZE_EXAMPLES

README = ROOT / "examples" / "optimize" / "paper_pose_1.json"
NAMES = ("pose_to_pose", "any_of", "glue_line", "over_a_post")
WHICH = ("all", "computed", "none")
CODINGS = ("identity", "gzip", "zstd")


def received(port: int, body: dict[str, Any], coding: str) -> bytes:
    """The body of the answer as it is on the wire."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
    connection.putrequest("POST", "/optimize", skip_accept_encoding=True)
    content = orjson.dumps(body)
    for name, value in {
        "Content-Type": "application/json",
        "Content-Length": len(content),
        "Accept-Encoding": coding,
    }.items():
        connection.putheader(name, str(value))
    connection.endheaders(content)
    answer = connection.getresponse()
    raw = answer.read()
    connection.close()
    if answer.status != 200:
        raise RuntimeError(f"{answer.status}: {raw[:500]!r}")
    return raw


def _milliseconds(work: Any) -> float:
    began = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - began)


def main() -> None:
    """Prints a table in kB."""
    requests: dict[str, Any] = {"README": orjson.loads(README.read_bytes())}
    requests |= {name: OPTIMIZE_EXAMPLES[name]["value"] or {} for name in NAMES}
    print(f"{'request':16}{'candidates':12}{'listed':>8}{'of':>6}" + "".join(f"{c:>10}" for c in CODINGS) + "  [kB]")
    with running() as service:
        for name, example in requests.items():
            for which in WHICH:
                raw = [received(service.port, {**example, "candidates": which}, coding) for coding in CODINGS]
                answer = orjson.loads(raw[0])
                total = sum(answer["candidate_counts"].values())
                sizes = "".join(f"{len(each) / 1e3:10.1f}" for each in raw)
                print(f"{name:16}{which:12}{len(answer['candidates']):8}{total:6}{sizes}")
            plain = received(service.port, {**example, "candidates": "all"}, "identity")
            packing = zstandard.ZstdCompressor(level=3)
            print(
                f"{'':16}compressing all of it: gzip {_milliseconds(lambda: gzip.compress(plain, 5)):.1f} ms, "  # noqa: B023
                f"zstd {_milliseconds(lambda: packing.compress(plain)):.1f} ms"  # noqa: B023
            )


if __name__ == "__main__":
    main()
