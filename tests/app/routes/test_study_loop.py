"""The loop with a threshold, as `examples/study_loop.sh` walks it."""

from __future__ import annotations

import csv
import io
import shutil
import subprocess

import pytest

from tests.app.live import ROOT, serving


@pytest.mark.long
@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_the_loop_ends_below_its_threshold() -> None:
    with serving(workers=2) as server:
        command = ["sh", "examples/study_loop.sh", server.url]
        told = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True
        ).stdout
        (study,) = server.get("/studies").json()["studies"]
    assert "low enough" in told
    assert study["threshold_met_by"] == study["best"]["number"] == study["last"]["number"] > 1
    rows = list(csv.DictReader(io.StringIO(told[told.index("iteration,created") :])))
    energies = [float(row["energy_J"]) for row in rows]
    assert energies == sorted(energies, reverse=True), (
        "each step took the best suggestion, which saves"
    )
    assert [row["threshold_met"] for row in rows] == ["false"] * (len(rows) - 1) + ["true"]
