"""The founding paper's experiment through POST /evaluate, and the page with both sets of tables."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.stats import spearmanr
from starlette.testclient import TestClient

from benchmarks import paper
from joulepath.models.robot import Array
from tests.app.live import ROOT

PRINTED = np.loadtxt(
    ROOT / "tests" / "reference" / "paper_table3_power.csv", delimiter=",", skiprows=1
)[:, 1]
# Printed figures may differ by rounding in their last digit, optimised ones between machines.
LAST_DIGIT = 1.01
OPTIMISED = 0.005


def mean_powers(client: TestClient, **settings: object) -> Array:
    found = []
    for number in range(1, 16):
        request = json.loads(
            (ROOT / "examples" / "evaluate" / f"paper_motion_{number}.json").read_text()
        )
        answer = client.post("/evaluate", json=request | settings).json()
        assert answer["total"]["balance_error"] < 1e-6
        found.append(answer["total"]["mean_mechanical_power"])
    return np.array(found)


def most_within(ratios: Array, share: float) -> int:
    """How many ratios lie within a share of one factor: the best of all factors."""
    factors = np.linspace(ratios.min(), ratios.max(), 20_000)
    return int((np.abs(ratios / factors[:, None] - 1) <= share).sum(axis=1).max())


def test_power_ranks_as_the_paper_prints_it(client: TestClient) -> None:
    powers = mean_powers(client)
    # 0.8321: the bound is not met by rounding
    assert spearmanr(powers, PRINTED).statistic >= 0.83
    assert 3 < powers.min() < powers.max() < 28, "the true means are some watts, not thousands"
    # with the UR5e's links the twelfth row lies 11.0 % off
    assert most_within(PRINTED / powers, 0.10) == 11
    assert most_within(PRINTED / powers, 0.1105) == 12


def test_twelve_rows_are_proportional_with_the_links_of_table_2s_arm(client: TestClient) -> None:
    powers = mean_powers(client, link_mass_scale=paper.older_links().tolist())
    assert spearmanr(powers, PRINTED).statistic >= 0.83
    assert most_within(PRINTED / powers, 0.10) == 12
    assert most_within(PRINTED / powers, 0.08) == 12


@pytest.mark.long
def test_the_page_is_what_the_command_makes() -> None:
    text = paper.PAGE.read_text()
    there = text.split(paper.BEGIN)[1].split(paper.END)[0].strip().splitlines()
    made = paper.made().strip().splitlines()
    assert len(there) == len(made)
    optimised = False
    number = re.compile(r"-?\d+(?:\.\d+)?")
    for ours, theirs in zip(made, there, strict=True):
        optimised |= ours.startswith("## The same moves")
        assert number.sub("#", ours) == number.sub("#", theirs)
        for one, other in zip(number.findall(ours), number.findall(theirs), strict=True):
            digit = 10.0 ** -len(one.partition(".")[2])
            share = OPTIMISED * max(abs(float(other)), 100.0) if optimised else 0.0
            assert float(one) == pytest.approx(float(other), abs=LAST_DIGIT * digit + share), (
                ours,
                theirs,
            )
