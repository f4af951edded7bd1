"""Figures written into a document and read again equal the figures of the fit."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from joulepath import Arm, Identification, IdentificationOptions, Log, Robot, identify, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import rigid_torques
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.identify.choices import DEFAULT_TERMS, Method, Term
from joulepath.optimizer.identify.estimates.grouped import GroupedEquations
from joulepath.optimizer.identify.fits.block import LawEquations
from joulepath.optimizer.identify.rows.fit_rows import Rows, rows_of
from tests.identification_logs import (
    WITHOUT_SPLIT,
    Recording,
    recorded,
    truth_of,
    with_current,
    written,
)
from tests.identification_logs import rigid_torques as true_torques
from tests.selection import long_but

ROBOT = load_robot("ur10e")
# relative; a few roundings of sums of some ten terms
EXACT = 1e-12
CURVED: tuple[Term, ...] = ("coulomb", "viscous", "curved", "load", "offset")


def log_of(robot: Robot = ROBOT, bend: float = 0.3, still: int | None = 5, **parts: Any) -> Log:
    """A log of a unit with curved friction and a joint that hardly moves."""
    truth = truth_of(robot, 4)
    recording: Recording = recorded(robot, truth, moves=10, seed=4)
    curve = truth.coulomb * np.arcsinh(recording.exact_v / bend)
    log = with_current(recording, recording.current + curve / truth.torque_constant).log()
    if still is not None:
        q, v, a = (np.array(each) for each in (log.q, log.v, log.a))
        q[:, still], v[:, still], a[:, still] = q[0, still], 0.0, 0.0
        log = replace(log, q=q, v=v, a=a)
    return replace(log, **parts)


def torques(robot: Robot, rows: Rows) -> tuple[Array, Array]:
    """Torques (n, nq) [N·m] of bodies, and of motors, by the robot's figures."""
    rigid = rigid_torques(robot.model, rows.q, rows.v, rows.a)
    motor = rigid + robot.drives.rotor_inertia * rows.a + robot.friction.torque(rows.v, rigid)
    return rigid, motor


def check(found: Identification, log: Log) -> None:
    rows = rows_of(found.robot, [log], regressor=found.options.needs_regressor)
    arm, robot = found.fitted.arm, written(found)
    rigid, motor = torques(robot, rows)
    fitted = arm.torque(rows) - arm.offset
    scale = np.abs(fitted).max()
    np.testing.assert_allclose(motor, fitted, rtol=0, atol=EXACT * scale)
    np.testing.assert_array_equal(robot.drives.torque_constant, arm.torque_constant)
    if np.isfinite(rows.power).any():
        # offsets belong to the sensors, and are no figures
        power = replace(arm, offset=np.zeros(robot.nq)).power(rows)[0]
        for row in range(0, len(power), 97):
            at = slice(row, row + 1)
            tau = rigid[at] + robot.drives.rotor_inertia * rows.a[at]
            energy = breakdown(np.ones(1), rows.v[at], rows.a[at], tau, 0.0, Arm(robot=robot))
            assert energy.electrical.total == pytest.approx(power[row], rel=EXACT)


@pytest.mark.parametrize("name", long_but(["ur5e"], ["ur10e", "ur5e"]))
@pytest.mark.parametrize(
    "terms", [("coulomb",), ("viscous", "offset"), ("coulomb", "curved"), ("coulomb", "viscous")]
)
def test_a_law_of_some_terms_is_the_best_one_of_these(name: str, terms: tuple[Term, ...]) -> None:
    """The reference is a bounded least-squares fit: the robot's own law has further terms."""
    robot = load_robot(name)
    log = log_of(robot, still=None, power=None)
    options = IdentificationOptions(terms=terms, constants=False, held_out=0.0)
    found = identify(robot, [log], options)
    arm, rows = found.fitted.arm, rows_of(robot, [log])
    error = rows.effort * robot.drives.torque_constant - arm.torque(rows)
    told = dict.fromkeys(range(robot.nq), True)
    for each in found.parameters:
        if each.joint is not None and each.figure != "offset":
            told[each.joint] &= each.identified
    joints = [joint for joint, all_told in told.items() if all_told]
    assert len(joints) >= 3
    for joint in joints:
        use = np.abs(rows.v[:, joint]) > options.velocity_threshold
        v, a, error_of = rows.v[use, joint], rows.a[use, joint], error[use, joint]
        columns = {
            "coulomb": v / np.hypot(v, arm.knee),
            "viscous": v,
            "curved": np.arcsinh(v / arm.speed[joint]),
            "offset": np.ones_like(v),
        }
        matrix = np.column_stack([*(columns[term] for term in terms), a])
        measured = error_of + arm.friction_torque(rows)[use, joint] + arm.rotor_inertia[joint] * a
        low = [-np.inf if term == "offset" else 0.0 for term in terms]
        best = lsq_linear(matrix, measured, bounds=([*low, 0.0], np.inf))
        assert error_of @ error_of == pytest.approx(2 * best.cost, rel=1e-6)


def test_equations_of_joints_that_keep_other_terms_are_those_without_their_torque() -> None:
    random = np.random.default_rng(0)
    columns, kept = random.normal(size=(50, 3)), random.normal(size=(50, 2))
    values, weight, group = random.normal(size=50), random.uniform(1, 2, 50), np.arange(50) % 4
    equations = LawEquations(GroupedEquations.of((columns, kept), values, weight, group, 4), 2)
    for joints in ([False, False], [True, False], [True, True]):
        rest = values - kept @ np.array(joints)
        direct = GroupedEquations.of(columns, rest, weight, group, 4)
        found = equations.keeping(np.array(joints))
        np.testing.assert_allclose(found.gram, direct.gram, rtol=EXACT)
        np.testing.assert_allclose(found.moment, direct.moment, rtol=0, atol=1e-12 * len(values))


@pytest.mark.long
@pytest.mark.parametrize(
    "options",
    long_but(
        [{"fit": ("rotor",)}],
        [{}, {"terms": ("coulomb",)}, {"fit": ("rotor",)}, {"fit": ("power",)}],
    ),
)
def test_figures_beside_earlier_ones_are_written_as_fitted(options: dict[str, Any]) -> None:
    """Figures unchanged by a later log keep the values of the earlier logs, instead of the maker's
    values.
    """
    log = log_of()
    first = identify(ROBOT, [log], IdentificationOptions(terms=CURVED, held_out=0.0))
    check(identify(written(first), [log], IdentificationOptions(held_out=0.0, **options)), log)


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "still"),
    long_but(
        [("base_parameters", 5), ("essential_parameters", None)],
        product(("base_parameters", "essential_parameters"), (5, None)),
    ),
)
def test_methods_without_links_write_the_other_figures_as_they_were_fitted(
    method: Method, still: int | None
) -> None:
    """The log is of an arm with the robot's own links, so its energies follow, too."""
    log = log_of(still=still)
    found = identify(ROBOT, [log], IdentificationOptions(method=method, held_out=0.0))
    arm, robot, rows = found.fitted.arm, written(found), rows_of(ROBOT, [log], regressor=True)
    for name in ("coulomb", "viscous", "curved", "speed"):
        np.testing.assert_array_equal(getattr(robot.friction, name), getattr(arm, name))
    load = np.zeros(ROBOT.nq) if robot.friction.load is None else robot.friction.load
    np.testing.assert_array_equal(load, arm.load)
    np.testing.assert_array_equal(robot.drives.rotor_inertia, arm.rotor_inertia)
    idle = next(each for each in found.parameters if each.figure == "idle_power")
    assert idle.value == robot.electronics.idle_power
    torque = rigid_torques(ROBOT.model, rows.q, rows.v, rows.a)
    torque = torque + robot.drives.rotor_inertia * rows.a
    energy = breakdown(rows.weight, rows.v, rows.a, torque, 0.0, Arm(robot=robot))
    # a tolerance for base parameters, which the log determines only approximately
    assert energy.electrical.total == pytest.approx(arm.energy(rows), rel=2e-3)


@pytest.mark.long
@pytest.mark.parametrize("terms", [DEFAULT_TERMS, CURVED])
def test_figures_of_power_beside_torques_behind_the_gears_are_written_as_they_were_fitted(
    terms: tuple[Term, ...],
) -> None:
    robot = load_robot("panda")
    truth = truth_of(robot, 3)
    recording = recorded(robot, truth, moves=6, seed=3)
    rigid = true_torques(robot, truth, recording.q, recording.v, recording.a)
    log = replace(recording.log("torque"), effort=rigid, torque_side="link")
    found = identify(robot, [log], IdentificationOptions(held_out=0.0, terms=terms))
    check(found, log)


def test_power_alone_is_identified_where_efforts_were_logged() -> None:
    log = log_of()
    found = identify(ROBOT, [log], IdentificationOptions(fit=("power",), held_out=0.0))
    without = replace(log, effort=None, effort_meaning=None)
    same = identify(ROBOT, [without], WITHOUT_SPLIT)
    values = [[each.value for each in one.parameters] for one in (found, same)]
    assert values[0] == pytest.approx(values[1], rel=1e-9)
    check(found, log)


def test_what_power_hardly_determines_keeps_its_letter_and_says_so() -> None:
    log = recorded(ROBOT, truth_of(ROBOT, 1), moves=3, seed=1).log()
    found = identify(
        ROBOT,
        [replace(log, effort=None, effort_meaning=None)],
        WITHOUT_SPLIT,
    )
    document, told = found.document("2026-01-31"), found.figures().identified
    sections = {
        "friction_laws": ROBOT.figures["friction_laws"][ROBOT.friction.name],
        "drives": ROBOT.figures["drives"],
        "electronics": ROBOT.figures["electronics"],
    }
    seen = 0
    for section, own in sections.items():
        written_ones = document[section].get("identified", document[section])
        for name, figure in written_ones.items():
            if name in told and not told[name].all() and figure != own.get(name):
                letter = own.get(name, own.get("coulomb"))["trust"]
                assert figure["trust"] == max("B", letter, key="ABCTE".index), name
                assert "hardly determine" in figure["note"] or "own values" in figure["note"]
                seen += 1
    assert seen >= 4


TERMS: tuple[tuple[Term, ...], ...] = (
    ("coulomb",),
    ("coulomb", "viscous"),
    ("coulomb", "curved"),
    DEFAULT_TERMS,
)
WITHOUT_POWER, POWER_ALONE = {"power": None}, {"effort": None, "effort_meaning": None}
CASES: list[tuple[dict[str, Any], dict[str, Any]]] = [
    *(({"terms": terms}, WITHOUT_POWER) for terms in (("viscous", "offset"), CURVED)),
    ({}, POWER_ALONE),
    ({"refit": True, "terms": CURVED}, {}),
]
LONG_CASES: list[tuple[dict[str, Any], dict[str, Any]]] = [
    *(({"terms": terms}, WITHOUT_POWER) for terms in TERMS),
    ({"fit": ("friction",)}, {}),
    ({"method": "threshold_velocity"}, {}),
    ({"fit": ("rotor",)}, {}),
    ({"fit": ("friction", "rotor", "torque_constant"), "terms": CURVED}, {}),
    ({"knee": 0.02}, {}),
    ({"estimator": "irls", "terms": CURVED}, {}),
    ({"refit": True, "terms": ("coulomb", "viscous", "offset")}, {}),
]


@pytest.mark.parametrize(("options", "parts"), long_but(CASES, [*CASES, *LONG_CASES]))
def test_figures_of_any_options_are_written_as_they_were_fitted(
    options: dict[str, Any], parts: dict[str, Any]
) -> None:
    log = log_of(**parts)
    check(identify(ROBOT, [log], replace(WITHOUT_SPLIT, **options)), log)


def test_losses_that_the_power_does_not_separate_are_not_counted_twice() -> None:
    """The robot's inverters have constant and quadratic losses of their own."""
    nq = ROBOT.nq
    drives = replace(
        ROBOT.drives, inverter_constant=np.full(nq, 2.0), inverter_quadratic=np.full(nq, 0.05)
    )
    figures = dict(ROBOT.figures)
    figures["drives"] = figures["drives"] | {
        name: figures["drives"][name] | {"value": getattr(drives, name).tolist()}
        for name in ("inverter_constant", "inverter_quadratic")
    }
    lossy = replace(ROBOT, drives=drives, figures=figures)
    log = log_of()
    found = identify(lossy, [log], WITHOUT_SPLIT)
    document = found.document("2026-01-31")
    idle = document["electronics"]["idle_power"]["value"]
    constants = document.get("drives", {}).get("inverter_constant", {}).get("value", [2.0] * nq)
    assert idle + sum(constants) == pytest.approx(found.fitted.arm.power_parameters.idle)


def test_the_bend_of_a_curved_law_is_the_best_one_and_is_written() -> None:
    bend = 0.3
    log = log_of(bend=bend, still=None, power=None)
    options = IdentificationOptions(terms=CURVED, held_out=0.0)
    for refit in (False, True):
        found = identify(ROBOT, [log], replace(options, refit=refit))
        law = written(found).friction
        told = [
            each.joint for each in found.parameters if each.figure == "curved" and each.identified
        ]
        assert len(told) >= 3
        # the candidates are apart by a factor of 1.45
        assert law.speed[told] == pytest.approx([bend] * len(told), rel=0.5)
        assert (law.speed[told] != ROBOT.friction.speed[told]).all()


def test_nothing_is_written_of_what_stays_the_robots_own() -> None:
    found = identify(
        ROBOT,
        [log_of(power=None)],
        IdentificationOptions(fit=("friction",), constants=False, held_out=0.0),
    )
    assert set(found.document("2026-01-31")) & {"drives", "electronics", "inertials"} == set()


def test_a_rotor_at_its_bound_stays_there_with_a_warning_if_the_log_rejects_the_robots_own() -> (
    None
):
    """The arm has no rotors, the robot has some: noise drives the fit below 0."""
    truth = replace(truth_of(ROBOT), rotor_inertia=np.full(ROBOT.nq, -0.02))
    log = replace(recorded(ROBOT, truth, moves=14).log(), power=None)
    for options in ({}, {"refit": True}):
        found = identify(ROBOT, [log], IdentificationOptions(held_out=0.0, **options))
        rotors = [each for each in found.parameters if each.figure == "rotor_inertia"]
        assert all(each.previous > 0 for each in rotors)
        at_bound = [each for each in rotors if each.value == 0]
        assert len(at_bound) >= 2
        for each in at_bound:
            assert each.identified and each.sd > 0 and "bound" in each.why
            joint = (each.joint or 0) + 1
            assert any(f"rotor_inertia of joint {joint}" in text for text in found.warnings)
        worse = replace(found.fitted.arm, rotor_inertia=ROBOT.drives.rotor_inertia)
        rows = rows_of(ROBOT, [log], regressor=found.options.needs_regressor)
        measured = rows.effort * ROBOT.drives.torque_constant
        errors = [np.square(measured - arm.torque(rows)).sum() for arm in (found.fitted.arm, worse)]
        assert errors[0] < 0.5 * errors[1]


def test_a_figure_at_its_bound_keeps_the_robots_own_if_the_log_allows_it() -> None:
    small = replace(ROBOT, drives=replace(ROBOT.drives, rotor_inertia=np.full(ROBOT.nq, 1e-4)))
    truth = replace(truth_of(ROBOT), rotor_inertia=np.full(ROBOT.nq, -1e-3))
    log = replace(recorded(ROBOT, truth, moves=14).log(), power=None)
    found = identify(small, [log], WITHOUT_SPLIT)
    kept = [
        each for each in found.parameters if each.figure == "rotor_inertia" and not each.identified
    ]
    assert len(kept) >= 3 and all(each.value == each.previous == 1e-4 for each in kept)
    assert not found.warnings
