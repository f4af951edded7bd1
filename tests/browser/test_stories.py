"""The studio page in a real browser: tasks of users, from the first minute to the saved result."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page, expect

from joulepath.app.api.report.bundle import attached_to
from joulepath.app.api.report.check import checked
from joulepath.app.api.report.numbers import digits
from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.optimizer.problem.robots import load_robot
from tests.app.live import ROOT, Server
from tests.browser.pages import (
    FIRST,
    SHOWN,
    fill_json,
    go,
    new_cell,
    opened,
    optimised,
    show_json,
    state,
    type_into,
    until,
)
from tests.browsers import BROWSER, MISSING
from tests.identification_logs import csv_of, recorded, truth_of

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

ROBOT = load_robot("ur5e")
PENDANT = {"start": "-420.0 280.0 300.0 0.000 3.142 0.000", "goal": "-350 -420 350 2.221 -2.221 0"}
"""Poses as a teach pendant shows them: mm, and RX RY RZ in radians."""
SAME = 0.01  # relative; two searches for one motion
RADIANS = "pose in mm and RX RY RZ in rad"


def paste(page: Page, text: str, reading: str = RADIANS) -> None:
    """Enters a text into the paste box and chooses its reading."""
    page.locator("#paste").fill(text)
    page.locator("#paste").press("Enter")
    page.locator("#readings").get_by_role("button", name=reading, exact=True).click()


def report(page: Page, kind: Literal["html", "pdf"]) -> bytes:
    """The report of the shown result, as a file."""
    names = {"html": "Page (HTML)", "pdf": "PDF, to print"}
    page.locator("#report > summary").click()
    with page.expect_download() as download:
        page.get_by_role("button", name=names[kind]).click()
    return Path(download.value.path()).read_bytes()


def test_a_programmer_takes_a_program_to_the_controller(browser: Browser, service: Server) -> None:
    """The cell starts empty and gets two poses of the pendant, 4 kg and a table."""
    with opened(browser, f"{service.url}/studio") as page:
        new_cell(page)
        expect(page.locator("#optimise")).to_be_disabled()
        page.locator("#change-robot").click()
        page.get_by_label("Search robots").fill("ur10e")
        page.get_by_role("option", name="Universal Robots UR10e").click()
        until(page, "() => studio.state.request.robot === 'ur10e'")
        paste(page, PENDANT["goal"])
        goal = state(page, "request.goal.pose")
        assert goal == {"position": [-0.35, -0.42, 0.35], "rotvec": [2.221, -2.221, 0]}
        page.locator("[data-row='/start']").get_by_label("More for Start").click()
        page.get_by_role("button", name="As a pose").click()
        page.locator("[data-row='/start'] input").first.focus()
        paste(page, PENDANT["start"])
        assert state(page, "request.start.pose.rotvec") == [0, 3.142, 0]
        type_into(page, "/payload/mass", "4")
        page.locator("#scene").get_by_text("Add", exact=True).click()
        page.get_by_role("button", name="Table or wall").click()
        type_into(page, "/scene/obstacles/0/pose/position/2", "-20")
        for row in ("/start", "/goal"):
            expect(page.locator(f"[data-row='{row}']")).to_contain_text("postures free")
        optimised(page)
        answer = state(page, "answered.solution")
        assert answer["robot"] == "ur10e" and answer["arm"]["payload"]["mass"] == 4
        page.get_by_label("Time per move or cycle").fill("6")
        page.get_by_label("Time per move or cycle").blur()
        expect(page.locator("#costs")).to_contain_text("Waiting with motors on")
        expect(page.locator("#costs thead")).to_contain_text("4,800×")
        notes = page.locator("#notes")
        expect(notes).to_contain_text("Waiting needs")
        expect(notes).to_contain_text(re.compile(r"Brakes after 0\.5 s at rest: .* J, .* % less"))
        expect(notes.get_by_role("button", name="Use brakes")).to_be_visible()
        page.locator("#export").click()
        expect(page.locator("#preview")).to_contain_text("0.1 of its speed")
        with page.expect_download() as download:
            page.locator("#download").click()
        program = Path(download.value.path()).read_text()
        assert "servoj" in program and re.search(r"payload.* 4 kg", program)


def test_a_programmer_makes_a_cycle_of_a_table(browser: Browser, service: Server) -> None:
    """Stops are pasted, ordered, duplicated and deleted; the cycle is exported as plain moves."""
    rows = [
        "pick;450;-250;150;0;3.142;0",
        "place;100;500;250;0;3.142;0",
        "rest;300;300;400;0;3.142;0",
    ]
    with opened(browser, f"{service.url}/studio") as page:
        new_cell(page)
        page.locator("#paste").evaluate(
            "(box, text) => { const data = new DataTransfer(); data.setData('text/plain', text);"
            "box.dispatchEvent(new ClipboardEvent('paste', { clipboardData: data, bubbles: true,"
            "cancelable: true })); }",
            "\n".join(rows),
        )
        page.locator("#readings").get_by_role("button", name=RADIANS, exact=True).click()
        names = "() => studio.state.request.stops.map(({ name }) => name).join()"
        assert page.evaluate(names) == "pick,place,rest"
        rest = page.locator("[data-row='/stops/2/target']")
        rest.get_by_label("rest X in mm").press("Alt+ArrowUp")
        assert page.evaluate(names) == "pick,rest,place"
        page.locator("[data-row='/stops/1/target']").get_by_label("More for rest").click()
        page.get_by_role("button", name="Delete", exact=True).click()
        assert page.evaluate(names) == "pick,place"
        page.keyboard.press("Control+z")
        assert page.evaluate(names) == "pick,rest,place"
        page.keyboard.press("Control+Shift+z")
        page.locator("[data-row='/stops/0/target'] input").nth(1).focus()
        page.get_by_role("radio", name="picks up").click()
        type_into(page, "/stops/0/payload/mass", "2")
        page.locator(".payload-form > summary").click()
        page.get_by_label("Shape of the payload").select_option("box")
        type_into(page, "/stops/0/payload/shape/size/2", "60")
        type_into(page, "/stops/0/dwell", "0.3")
        page.locator("[data-row='/stops/1/target'] input").nth(1).focus()
        page.get_by_role("radio", name="puts down").click()
        optimised(page)
        legs = state(page, "answered.cycle.legs")
        expect(page.locator("#legs tbody tr")).to_have_count(len(legs))
        carried = state(page, "answered.asked.stops")[0]["payload"]
        assert carried["shape"]["size"] == [0.06, 0.06, 0.06] and carried["mass"] == 2
        expect(page.locator("#notes")).not_to_contain_text("has no shape")
        total = sum(leg["electrical"] for leg in legs)
        assert float(page.locator("#joules").inner_text().split()[0]) == pytest.approx(
            total, rel=0.01
        )
        home = sum(
            leg["electrical"]
            for leg in legs
            if leg["kind"] == "move" and "start" in (leg["start"]["stop"], leg["goal"]["stop"])
        )
        expect(page.locator("#notes")).to_contain_text(f"from and to the start need {home:.3g} of")
        expect(page.get_by_role("button", name="Omit")).to_be_visible()
        page.locator("#export").click()
        page.locator("[data-format=movej]").click()
        page.get_by_label("Gripper output").select_option("0")
        expect(page.locator("#preview")).to_contain_text("set_standard_digital_out(0, True)")
        with page.expect_download() as download:
            page.locator("#download").click()
        program = Path(download.value.path()).read_text()
        assert program.count("movej([") == 4, "start, two stops, and back"
        assert "set_target_payload(2," in program
        put_down = program.index("# place"), program.index("# start", program.index("# place"))
        for line in ("set_standard_digital_out(0, False)", "set_target_payload(0,"):
            assert put_down[0] < program.index(line, put_down[0]) < put_down[1]


def test_a_researcher_brings_an_own_arm(browser: Browser, service: Server, tmp_path: Path) -> None:
    """A URDF leads to a table of samples; targets come from sliders and from the pose of
    the arm.
    """
    urdf = tmp_path / "Two joints.urdf"
    urdf.write_text(ARM["urdf"])
    with opened(browser, f"{service.url}/studio") as page:
        new_cell(page)
        page.locator("#change-robot").click()
        page.get_by_role("button", name="Add your own arm").click()
        page.get_by_role("button", name="Add the arm").click()
        expect(page.locator(".own-arm")).to_contain_text("Choose the URDF file.")
        page.get_by_label("URDF file").set_input_files(urdf)
        page.get_by_label("Largest payload, kg").fill("2")
        page.get_by_role("button", name="Add the arm").click()
        until(page, "() => studio.state.request.robot === 'two_joints'")
        move = service.get("/robots/two_joints").json()["example_move"]
        assert state(page, "request.start.q") == move["start"]
        page.locator("[data-row='/start']").get_by_label("More for Start").click()
        page.get_by_role("button", name="Joint sliders").click()
        page.get_by_role("slider", name="elbow").fill("1")
        page.get_by_role("button", name="Done").click()
        assert state(page, "request.start.q") == [0, 1]
        page.locator("[data-row='/goal']").get_by_label("More for Goal").click()
        page.get_by_role("button", name="Joint sliders").click()
        page.get_by_role("slider", name="shoulder").fill("0.8")
        page.get_by_role("button", name="Done").click()
        optimised(page)
        goal = state(page, "answered.solution.branch.goal.q")
        page.locator("#export").click()
        with page.expect_download() as download:
            page.get_by_role("button", name="Samples (CSV)").click()
        rows = list(csv.reader(io.StringIO(Path(download.value.path()).read_text())))
        assert rows[0][:3] == ["t", "q1", "q2"]
        assert [float(each) for each in rows[-1][1:3]] == pytest.approx(goal, abs=1e-6)
        page.get_by_role("button", name="Close").click()
        go(page, "Library")
        page.get_by_role("button", name="Delete two_joints").click()
        expect(page.get_by_role("region", name="Your robots")).not_to_contain_text("two_joints")


def test_a_researcher_takes_a_front(browser: Browser, service: Server) -> None:
    """A front gives the least energy of every duration, and its table's least one is the answer."""
    lift = json.loads((ROOT / "examples" / "pareto" / "lift.json").read_text())
    asked = {name: value for name, value in lift.items() if name not in ("points", "duration")}
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        fill_json(page, asked)
        optimised(page)
        own = state(page, "answered.solution")
        page.get_by_role("tab", name="Energy over time").click()
        page.locator("#compute-front").click()
        with page.expect_download() as download:
            page.locator("#front-csv").click()
        rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
        energies = [float(row["energy_J"]) for row in rows]
        assert len(rows) == page.locator("#front .point").count() > 1
        assert [float(row["duration_s"]) for row in rows] == sorted(
            float(row["duration_s"]) for row in rows
        )
        assert min(energies) == pytest.approx(own["energy"]["electrical"]["total"], rel=SAME)
        fastest = page.locator("#front .point").first
        expect(fastest).to_have_attribute(
            "title", re.compile(rf"{float(rows[0]['duration_s']):.3g} s")
        )


NAMES = ["bin to shelf", "shelf to bin", "bin to far"]


def test_an_engineer_takes_a_table_of_moves_overnight(
    browser: Browser, service: Server, tmp_path: Path
) -> None:
    """The job has moves from a CSV file, in the current cell; it ends with totals and a CSV."""
    start, goal = "-420;280;300;0;3.142;0", "-350;-420;350;1.571;0;0"
    table = tmp_path / "line 2.csv"
    head = "from;to;kg;x mm;y;z;rx rad;ry;rz;x;y;z;rx;ry;rz"
    away = "-3000;0;300;0;3.142;0"
    rows = [
        f"bin;shelf;0.8;{start};{goal}",
        f"shelf;bin;0;{goal};{start}",
        f"bin;far;0;{start};{away}",
    ]
    table.write_text("\n".join([head, *rows]))
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        fill_json(page, {"start": FIRST["start"], "goal": FIRST["goal"], "windings": False})
        show_json(page, False)
        go(page, "Jobs")
        page.locator("#new-job").click()
        page.locator("#moves-file").set_input_files(table)
        expect(page.get_by_role("dialog")).to_contain_text(f"3 moves, read as {RADIANS}")
        page.locator("#start-job").click()
        expect(page.locator("#job-progress")).to_have_text("3 of 3 moves")
        expect(page.locator("#moves tbody tr.failed")).to_contain_text("out of reach")
        page.get_by_role("button", name="Load intervals and savings").click()
        for row in page.locator("#moves tbody tr").all()[:2]:
            expect(row).to_contain_text(" to ")
        with page.expect_download() as download:
            page.locator("#job-csv").click()
        lines = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
        assert [line["state"] for line in lines] == ["done", "done", "failed"]
        assert [line["move"] for line in lines] == NAMES
        joules = [float(line["energy_J"]) for line in lines[:2]]
        for line, energy in zip(lines, joules, strict=False):
            assert float(line["p5_J"]) < energy < float(line["p95_J"])
        total = page.locator("#job-totals dd").first.inner_text()
        assert float(total.split()[0]) == pytest.approx(sum(joules), rel=0.01)
        text = report(page, "html").decode()
        assert "<td>bin to shelf</td>" in text and "1 of 3 moves has no answer" in text
        assert f"<strong>{digits(sum(joules))}</strong> J" in text
        assert report(page, "pdf").startswith(b"%PDF")
        page.locator("#moves tbody tr.failed").get_by_role(
            "button", name="Open in the cell"
        ).click()
        until(page, "() => studio.state.page === 'cell' && Boolean(studio.state.trouble)")
        expect(page.locator("[data-row='/goal']")).to_contain_text("out of reach")
    # A viewer elsewhere sees the names and the requested moves.
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        go(page, "Jobs")
        page.locator("#jobs button.choice", has_text="line 2").click()
        for name in NAMES:
            expect(page.locator("#moves")).to_contain_text(name)
        page.get_by_role("button", name=NAMES[1]).click()
        until(page, "() => studio.state.page === 'cell' && !studio.state.stale")
        assert state(page, "request.goal.pose.position") == [-0.42, 0.28, 0.3]


def test_an_engineer_reports_to_those_who_decide(page: Page) -> None:
    """The report has the costs of the user, as a page and as PDF."""
    fill_json(page, FIRST)
    show_json(page, False)
    optimised(page)
    page.locator("#costs").get_by_role("button", name="Assumptions").click()
    page.get_by_label("Electricity in € per kWh").fill("0.31")
    page.get_by_label("Electricity in € per kWh").blur()
    expect(page.locator("#costs")).to_contain_text("0.31 € per kWh (yours)")
    joules = page.locator("#joules").inner_text().split()[0]
    text = report(page, "html").decode()
    assert joules in text and "0.31" in text and "EEA" in text
    assert report(page, "pdf").startswith(b"%PDF")


def test_an_engineer_compares_a_log_with_what_was_predicted(
    browser: Browser, service: Server, tmp_path: Path
) -> None:
    """The joules of every move stand beside their prediction, on the page and in a
    verified report.
    """
    file = tmp_path / "monday.csv"
    file.write_bytes(csv_of(recorded(ROBOT, truth_of(ROBOT), moves=3)))
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        go(page, "Logs")
        page.locator("#log-file").set_input_files(file)
        page.locator("#add-log").click()
        whole = page.locator("#measured tr.total td")
        expect(whole.last).to_contain_text("%")
        measured = float(whole.nth(2).inner_text().replace(",", ""))
        page_of_log = report(page, "html")
        assert "<h1>monday.csv</h1>" in page_of_log.decode()
        expect(page.locator("#logs")).not_to_contain_text("This log is from")
        go(page, "Cell")
        page.locator("#change-robot").click()
        page.get_by_label("Search robots").fill("ur10e")
        page.get_by_role("option", name="Universal Robots UR10e").click()
        go(page, "Logs")
        expect(page.locator("#logs")).to_contain_text("This log is from a Universal Robots UR5e")
        drawn = attached_to(page_of_log).answer["total"]["measured"]["electrical"]
        assert measured == pytest.approx(drawn, rel=0.01)
        assert checked(page_of_log, True, "test").agrees
