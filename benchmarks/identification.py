"""Identification on real logs and on simulated arms, against its gates.

    JOULEPATH_TEST_DATA=FOLDER python -m benchmarks.identification
    python -m benchmarks.identification --only synthetic standins --runs 200

- `ur3e`: power from motion alone. Every motion is held out with its reverse motion, and predicted.
  Then fits to five random moves predict the rest of the log.
- `tx40`: friction compared with published values from the same log, and predictions of each half of
  the log by a fit to the other half.
- `synthetic`: a simulated UR10e with known figures. The shares are of figures within three standard
  deviations of the true value, and of energies of unseen moves between P5 and P95; the latter also
  for moves with an additional random power. The limits of the gates are for 200 runs, which take
  some minutes; fewer runs have a margin for their sampling error.
- `cycles`: share of the energies of cycles between P5 and P95, in another log of a simulated UR10e,
  for moves with an additional random power.
- `standins`: simulated logs in place of real ones that are not public: another motion of the day
  and other days of a UR10e, a payload from logs of two days, and halves of a log of a Panda.
- `speed`: processor time to read a log of 41 s and to identify the arm.
- `outsider`: errors of torques of held-out motions of a real UR10e and two Pandas, relative to the
  errors of an ordinary least-squares fit without knowledge of the links.
- `sessions`, `ur10e_sessions`: share of the energies of other days between P5 and P95, by the
  number of logs of the fit, for simulated arms with drifting friction and for a real UR10e.

The exit code is 1 if a gate is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.gate import Gate, sampling_margin
from benchmarks.identification_logs import MISSING, WRIST, folder, tx40, tx40_reference, ur3e
from benchmarks.identification_outsider import outsider
from benchmarks.identification_sessions import MOVE_EFFECT, cycles, sessions, ur10e_sessions
from benchmarks.identification_standins import RATE, TORQUE_SENSOR, behind_the_gears, day_of, log_of
from joulepath.models.robot import Robot
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.fits.block import moving_rows
from joulepath.optimizer.identify.fits.fitting import fit_rows
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.reading import read_log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.quality.validation import torque_errors
from joulepath.optimizer.identify.results import TorqueErrors
from joulepath.optimizer.identify.rows.fit_rows import Rows, rows_of
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.robots import load_robot
from tests.identification_logs import Truth, csv_of, off_the_model, recorded, truth_of

UNITS = 4
"""Number of simulated arms."""
DAYS = 8
"""Number of logs per arm, one per day; the first log is fitted."""
DAY_SD = 0.03
"""Relative standard deviation of the friction between days [1]."""
DRAWS = 100
MOVES_OF_A_DRAW = 5
IDENTIFIED_SHARE = 0.2
"""Smallest share of runs in which a figure is identified, for a gate on this figure [1]."""
REPEATS = 3
"""Number of time measurements."""
TX40_OPTIONS = IdentificationOptions(
    terms=("coulomb", "viscous", "offset"),
    couplings=(WRIST,),
    method="base_parameters",
    held_out=0.0,
)


def ur3e_power(place: Path | None, _: int) -> list[Gate]:
    """Power of the UR3e from its motion."""
    assert place is not None
    robot, log = ur3e(place)
    log = replace(log, effort=None, effort_meaning=None)
    found = identify(robot, [log], IdentificationOptions(held_out=1.0)).validation
    assert found is not None and found.fitted.power is not None
    assert found.coverage is not None and found.half_width is not None
    errors, draws = (
        found.fitted.power,
        _draws(robot, rows_of(robot, [log]), IdentificationOptions(held_out=0.0)),
    )
    return [
        Gate("ur3e, left out with its reverse: RMSE [W]", errors.rmse, 0.0, 2.0),
        Gate("ur3e, same: mean error of energy [%]", errors.energy_mean, 0.0, 1.3),
        Gate("ur3e, same: greatest error of energy [%]", errors.energy_max, 0.0, 4.0),
        Gate("ur3e, same: share between P5 and P95", found.coverage, 0.85, 1.0),
        Gate("ur3e, same: half of P5 to P95 [%]", found.half_width, 0.0, 2.5),
        Gate("ur3e, five moves: P90 of the error of the rest's energy [%]", draws, 0.0, 1.5),
    ]


def _draws(robot: Robot, rows: Rows, options: IdentificationOptions) -> float:
    """P90 of the error of the energy of all other motions, predicted from random moves [%]."""
    random, errors = np.random.default_rng(0), list[float]()
    moves = np.unique(rows.move)
    for _ in range(DRAWS):
        seen = np.isin(rows.move, random.choice(moves, MOVES_OF_A_DRAW, replace=False))
        rest = rows.take(~np.isin(rows.group, rows.group[seen]))
        blind = fit_rows(robot, rows.take(seen), options)
        errors.append(
            float(rest.weight @ blind.arm.power(rest)[0] / (rest.weight @ rest.power)) - 1
        )
    return 100 * float(np.percentile(np.abs(errors), 90))


def tx40_torque(place: Path | None, _: int) -> list[Gate]:
    """Friction and torques of the TX40."""
    assert place is not None
    robot, log = tx40(place)
    rows = rows_of(robot, [log], regressor=True)
    near = agreeing(fit_rows(robot, rows, TX40_OPTIONS).estimate, tx40_reference(place))
    found = [Gate("tx40: published friction figures met, of 13", near, 12, 13)]
    first = np.arange(len(rows.q)) < len(rows.q) // 2
    for name, half in (("first", first), ("second", ~first)):
        arm, rest = fit_rows(robot, rows.take(half), TX40_OPTIONS).arm, rows.take(~half)
        error = rest.effort - arm.torque(rest)
        for joint, most in enumerate((10.0, 8.0, 13.0, 12.0, 22.0, 20.0)):
            of = moving_rows(
                rest, rest.effort, joint, TX40_OPTIONS.velocity_threshold, TX40_OPTIONS.couplings
            )
            relative = 100 * float(
                np.linalg.norm(error[of, joint]) / np.linalg.norm(rest.effort[of, joint])
            )
            found.append(
                Gate(f"tx40, {name} half predicts the other: J{joint + 1} [%]", relative, 0.0, most)
            )
    return found


def agreeing(fitted: Estimate, reference: dict[str, tuple[float, float]]) -> int:
    """The number of published friction figures with a standard deviation below 5 % that the fit
    meets within three standard deviations or 3 %.

    The published terms of joints 5 and 6 contain the viscous friction of the coupling.
    """
    values = dict(zip(fitted.names, fitted.value.tolist(), strict=True))
    shared = values["coupling.viscous", 0]
    ours = {"fvm6": shared, "fsm6": values["coupling.coulomb", 0]}
    for joint in range(6):
        ours[f"fv{joint + 1}"] = values["viscous", joint] + (shared if joint >= 4 else 0.0)
        ours[f"fs{joint + 1}"] = values["coulomb", joint]
    precise = [name for name in ours if reference[name][1] < 0.05 * abs(reference[name][0])]
    return sum(
        abs(ours[n] - reference[n][0]) <= max(3 * reference[n][1], 0.03 * abs(reference[n][0]))
        for n in precise
    )


def synthetic(_: Path | None, runs: int) -> list[Gate]:
    """Simulated arms with known figures, from currents and power or from power alone."""
    return [
        gate
        for channels in ("currents and power", "power alone")
        for effect in (0.0, MOVE_EFFECT)
        for gate in _of_simulated_arms(channels, effect, runs)
    ]


def _of_simulated_arms(channels: str, effect: float, runs: int) -> list[Gate]:
    robot, shares, within = load_robot("ur10e"), list[float](), dict[Name, list[bool]]()
    for seed in range(runs):
        truth = truth_of(robot, seed)
        log = off_the_model(recorded(robot, truth, moves=14, seed=seed).log(), effect, seed)
        found = identify(
            robot,
            [replace(log, effort=None, effort_meaning=None) if channels == "power alone" else log],
        )
        assert found.validation is not None and found.validation.coverage is not None
        shares.append(found.validation.coverage)
        for each in found.parameters:
            if each.identified:
                near = abs(each.value - _true(truth, each.figure, each.joint)) <= 3 * each.sd
                within.setdefault((each.figure, each.joint), []).append(near)
    # a share over few runs has a large sampling error
    often = [each for each in within.values() if len(each) >= IDENTIFIED_SHARE * runs]
    title = f"synthetic, {runs} arms from {channels}" + f", moves off by {effect:g} W" * bool(
        effect
    )
    every = [near for each in within.values() for near in each]
    worst = min(often, key=lambda each: float(np.mean(each)))
    # a single figure has a gate only without additional power
    least = 0.0 if effect else 0.95 - sampling_margin(np.sqrt(0.95 * 0.05), len(worst))
    margin = sampling_margin(float(np.std(shares)), runs)
    return [
        Gate(f"{title}: figures within 3 standard deviations", float(np.mean(every)), 0.95, 1.0),
        Gate(f"{title}: the same of the worst figure", float(np.mean(worst)), least, 1.0),
        Gate(
            f"{title}: share between P5 and P95",
            float(np.mean(shares)),
            0.85 - margin,
            0.95 + margin,
        ),
    ]


def _true(truth: Truth, figure: str, joint: int | None) -> float:
    """The true value of a figure of a simulated arm with the link masses of the robot."""
    if joint is None:
        return {"idle_power": truth.idle_power, "link_mass_scale": 1.0}[figure]
    return float(getattr(truth, figure)[joint])


def standins(_: Path | None, __: int) -> list[Gate]:
    """Simulated logs in place of real logs, with effects that the fitted model lacks."""
    return [*_days(), *_payloads(), *_halves()]


def _days() -> list[Gate]:
    """Figures of a UR10e from 30 s of a day, on another motion of this day and on other days."""
    robot, same_day, other_days = load_robot("ur10e"), list[TorqueErrors](), list[TorqueErrors]()
    for unit in range(UNITS):
        truth, random = truth_of(robot, unit), np.random.default_rng(unit)
        found = identify(
            robot,
            [log_of(robot, day_of(robot, truth, 100 + unit, 1.0, 10))],
            IdentificationOptions(held_out=0.0),
        )
        for day in range(DAYS):
            friction = random.normal(1.0, DAY_SD) if day else 1.0
            other = day_of(robot, truth, 200 + 10 * unit + day, friction, 6)
            errors = found.validate([log_of(robot, other)]).fitted.torque
            assert errors is not None
            (other_days if day else same_day).append(errors)
    relative = np.max([each.relative for each in same_day], axis=0)
    gates = [
        Gate(
            f"stand-in of a UR10e, {UNITS} units, another motion: J{joint + 1} [%]",
            float(relative[joint]),
            0.0,
            most,
        )
        for joint, most in enumerate((7.0, 1.7, 1.8, 3.3, 6.3, 6.2))
    ]
    shaft = float(np.median([day.shaft_energy for day in other_days]))
    copper = float(np.median([day.copper_energy for day in other_days]))
    title = f"stand-in of a UR10e, {DAYS - 1} other days each"
    return [
        *gates,
        Gate(f"{title}: shaft energy, median [%]", shaft, 0.0, 3.0),
        Gate(f"{title}: copper energy, median [%]", copper, 0.0, 1.5),
    ]


def _payloads() -> list[Gate]:
    """A payload of 2.805 kg from a log without payload, and from a log of another day with it."""
    robot, payload = load_robot("ur10e"), Payload(2.805, np.array([0.0, 0.0, 0.06]))
    off, sd = list[float](), list[float]()
    for unit in range(UNITS):
        truth, friction = truth_of(robot, unit), np.random.default_rng(unit).normal(1.0, DAY_SD)
        empty = log_of(robot, day_of(robot, truth, 400 + unit, 1.0, 10))
        full = log_of(robot, day_of(robot, truth, 500 + unit, friction, 10, payload))
        carried = identify(
            robot, [empty, full], IdentificationOptions(fit=("payload",), held_out=0.0)
        ).payload
        assert carried is not None
        off.append(100 * abs(carried.mass / payload.mass - 1))
        sd.append(float(np.sqrt(carried.covariance[0, 0])))
    title = f"stand-in of a UR10e, {UNITS} units, payload of two days"
    return [
        Gate(f"{title}: error, greatest [%]", max(off), 0.0, 1.5),
        Gate(f"{title}: standard deviation, median [kg]", float(np.median(sd)), 0.0, 0.02),
    ]


def _halves() -> list[Gate]:
    """Halves of a log of a Panda predict each other; torques are measured behind the gears."""
    robot, worst = load_robot("panda"), np.zeros(7)
    for unit in range(UNITS):
        truth = behind_the_gears(truth_of(robot, unit))
        recording = day_of(robot, truth, 600 + unit, 1.0, 32, noise=TORQUE_SENSOR)
        rows = rows_of(robot, [log_of(robot, recording, torque=True)], True)
        first = np.arange(len(rows.q)) < len(rows.q) // 2
        for half in (first, ~first):
            arm = fit_rows(
                robot, rows.take(half), IdentificationOptions(held_out=0.0, refit=True)
            ).arm
            worst = np.maximum(worst, torque_errors([(arm, rows.take(~half))], 0.02).relative)
    return [
        Gate(
            f"stand-in of a Panda, {UNITS} units, halves: J{joint} [%]",
            float(worst[joint - 1]),
            0.0,
            1.6,
        )
        for joint in (2, 3, 4)
    ]


def speed(_: Path | None, __: int) -> list[Gate]:
    """Processor time to read and identify a log of 41 s with all channels."""
    robot, times = load_robot("ur10e"), list[float]()
    recording = recorded(robot, truth_of(robot), moves=14, rate=RATE)
    file = csv_of(recording, "own")
    while len(times) < REPEATS:
        start = process_time()
        identify(robot, [read_log(file, robot).log])
        times.append(process_time() - start)
    what = f"{recording.time[-1]:.0f} s of log at {RATE:g} Hz, read and identified"
    return [Gate(f"{what}: time of the processor [s]", min(times), 0.0, 1.0)]


PARTS: dict[str, Callable[[Path | None, int], list[Gate]]] = {
    "ur3e": ur3e_power,
    "tx40": tx40_torque,
    "synthetic": synthetic,
    "cycles": cycles,
    "standins": standins,
    "speed": speed,
    "outsider": outsider,
    "sessions": sessions,
    "ur10e_sessions": ur10e_sessions,
}
OF_LOGS = ("ur3e", "tx40", "outsider", "ur10e_sessions")


def main() -> int:
    """Prints every gate. Returns 1 if one is missed."""
    arguments = parser(__doc__)
    arguments.add_argument(
        "--only", nargs="+", choices=PARTS, default=list(PARTS), help="parts (all)"
    )
    arguments.add_argument("--runs", type=int, default=20, help="simulated arms (%(default)s)")
    given, place = arguments.parse_args(), folder()
    on_one_core()
    gates = list[Gate]()
    for part in given.only:
        if part in OF_LOGS and place is None:
            print(f"{part}: left out. {MISSING}")
            continue
        try:
            for gate in PARTS[part](place, given.runs):
                gates.append(gate)
                verdict = "kept  " if gate.kept else "MISSED"
                within = f"{gate.least:g} to {gate.most:g}"
                print(f"{verdict}  {gate.what}: {gate.value:.4g} ({within})", flush=True)
        except FileNotFoundError as missing:
            print(f"{part}: left out. {missing}")
    write_json(given.json, {"gates": [gate.__dict__ | {"kept": gate.kept} for gate in gates]})
    return 0 if all(gate.kept for gate in gates) else 1


if __name__ == "__main__":
    sys.exit(main())
