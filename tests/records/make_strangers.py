"""Write the files of ``strangers/``: one small record in the ways in which loggers, spreadsheets and programs write it.

``python tests/records/make_strangers.py`` writes them again; ``test_strangers.py`` says what becomes of each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "strangers"
WAY = np.concatenate([np.linspace(0, 2, 5), *[np.linspace(2, -2, 9)[1:], np.linspace(-2, 2, 9)[1:]] * 2])
ANGLE = 20 * WAY + np.concatenate([np.full(5, -0.5), *[np.full(8, 0.5), np.full(8, -0.5)] * 2])
TIME = np.round(0.25 * np.arange(WAY.size), 2)
"""Two cycles after an approach: mm, deg, s."""
START = datetime(2026, 5, 3, 23, 59, 57)
TRIAL = np.repeat([1, 2, 3], WAY.size)

Cells = Iterable[Iterable[object]]


def number(value: object) -> str:
    return value if isinstance(value, str) else f"{value:.10g}"


def table(names: str | None, rows: Cells, by: str = ",", end: str = "\n", decimal: str = ".") -> str:
    """Lines of a table; a comma in ``decimal`` is that of the numbers."""
    lines = [] if names is None else [names]
    for row in rows:
        cells = (number(cell) if isinstance(cell, str) else number(cell).replace(".", decimal) for cell in row)
        lines.append(by.join(cells))
    return end.join(lines) + end


def rows(time: Cells = TIME, drive: Cells = WAY, angle: Cells = ANGLE, *more: Cells) -> Cells:
    return zip(time, drive, angle, *more, strict=True)


def clock(form: str, step: float = 0.25) -> list[str]:
    return [(START + timedelta(seconds=step * i)).strftime(form) for i in range(WAY.size)]


def only(values: Iterable[float], keep: Callable[[int], bool], empty: str = "") -> list[object]:
    return [value if keep(i) else empty for i, value in enumerate(values)]


def plain() -> dict[str, str]:
    """Delimiters, marks, names, lines above and below."""
    head = "time_s,drive_mm,angle_deg"
    grid = table(head, rows())
    comma = table("time_s;drive_mm;angle_deg", rows(), ";", decimal=",")
    german = str.maketrans(",.", ".,")
    thousands = [(f"{t:.2f}", f"{1000 * x:,.2f}", f"{a:.2f}") for t, x, a in rows()]
    thousands = table("time_s;steps;angle_deg", [[cell.translate(german) for cell in row] for row in thousands], ";")
    english = table("time_s,steps,angle_deg", [(t, f'"{1000 * x:,.2f}"', a) for t, x, a in rows()])
    return {
        "plain.csv": grid,
        "empty-columns.csv": table("time_s,drive_mm,angle_deg,,", rows(TIME, WAY, ANGLE, [""] * 37, [""] * 37)),
        "empty-columns-of-rows.csv": table(head, rows(TIME, WAY, ANGLE, [""] * 37, [""] * 37)),
        "preamble.csv": "Bench 3\nOperator: A. N. Other, 2nd floor\n\n" + grid,
        "preamble-with-numbers.csv": "Sample rate,4\nGain,2,3\nDate,2026-05-03\n\n" + grid,
        "units-below.csv": table("Time,Drive,Angle\ns,mm,deg", rows()),
        "units-below-in-brackets.csv": table("Time,Stage travel,Bending\n(ms),(um),(rad)",
                                             rows(1e3 * TIME, 1e3 * WAY, np.radians(ANGLE))),
        "units-as-names.csv": table("s;um;rad", rows(TIME, 1e3 * WAY, np.radians(ANGLE)), ";"),
        "units-above.csv": table("s,mm,mrad\nTime,Drive,Angle", rows(TIME, WAY, 1e3 * np.radians(ANGLE))),
        "semicolons.csv": table("time_s;drive_mm;angle_deg", rows(), ";"),
        "semicolons-trailing.csv": table("time_s;drive_mm;angle_deg;", rows(TIME, WAY, ANGLE, [""] * 37), ";",
                                         decimal=","),
        "semicolons-trailing-below.csv": table("time_s;drive_mm;angle_deg", rows(TIME, WAY, ANGLE, [""] * 37), ";"),
        "decimal-commas.csv": comma,
        "decimal-commas-tabs.txt": table("time_s\tdrive_mm\tangle_deg", rows(), "\t", decimal=","),
        "decimal-commas-quoted.csv": table(head, [[f'"{number(c)}"'.replace(".", ",") for c in row] for row in rows()]),
        "decimal-commas-between-commas.csv": table(
            head, [[f"{c:.2f}".replace(".", ",") for c in row] for row in rows()]),
        "excel-sep.csv": "sep=;\n" + comma,
        "tabs.tsv": table("time_s\tdrive_mm\tangle_deg", rows(), "\t"),
        "tabs-without-names.tsv": table(None, rows(), "\t"),
        "bars.txt": table("time_s|drive_mm|angle_deg", rows(), "|"),
        "spaces-aligned.txt": "\n".join([f"{'time_s':>10}{'drive_mm':>12}{'angle_deg':>12}",
                                         *(f"{t:10.3f}{x:12.4f}{a:12.4f}" for t, x, a in rows())]) + "\n",
        "spaces-names-of-two-words.txt": "\n".join([f"{'Time [s]':>12}{'Stage travel [mm]':>24}{'Tip angle [deg]':>20}",
                                                    *(f"{t:12.3f}{x:24.4f}{a:20.4f}" for t, x, a in rows())]) + "\n",
        "savetxt.txt": "\n".join(["# time_s drive_mm angle_deg",
                                  *(" ".join(f"{c:.18e}" for c in row) for row in rows())]) + "\n",
        "comments.csv": "% bench\n# run 4\n" + grid.replace("\n2,", "\n# hand off the table\n2,"),
        "thousands-points.csv": thousands,
        "thousands-commas.csv": english,
        "thousands-or-decimals.csv": table("drive_mm,angle_deg", [('"1,500"' if x > 0 else '"2,500"', f"{a:.0f}")
                                                                   for x, a in zip(WAY, ANGLE, strict=True)]),
        "quoted.csv": table('"time_s","drive_mm","angle_deg","note"',
                            [(f'"{t}"', f'"{x}"', f'"{a}"', '"held, by hand"') for t, x, a in rows()]),
        "quoted-names-of-two-lines.csv": table('"Time\n(s)","Drive\n(mm)","Angle\n(deg)"', rows()),
        "quote-not-closed.csv": grid.replace("\n2,", '\n2,"', 1),
        "names-again.csv": grid + grid.replace("time_s,drive_mm,angle_deg\n", "time_s,drive_mm,angle_deg\n", 1),
        "footer.csv": grid + "End of test\nMax,2,40.5\n",
        "cut-off.csv": grid[:-8].rsplit("\n", 1)[0] + "\n9,2",
        "short-row.csv": grid.replace("\n2,", "\n2,1\n2,", 1),
        "words-in-a-row.csv": grid.replace("\n2,", "\nstop,", 1),
        "names-twice.csv": table("time_s,angle_deg,angle_deg", rows()),
        "same-column-twice.csv": table("time_s,drive_mm,angle_deg,time_s", rows(TIME, WAY, ANGLE, TIME)),
        "old-mac-lines.csv": grid.replace("\n", "\r"),
        "dos-lines.csv": grid.replace("\n", "\r\n"),
        "fortran.dat": "\n".join([" time_s drive_mm angle_deg",
                                  *(" ".join(f"{c:.8E}".replace("E", "D") for c in row) for row in rows())]) + "\n",
        "no-numbers.csv": "name,colour\na,red\nb,blue\nc,green\n",
    }  # fmt: skip


def times() -> dict[str, str]:
    """Times of clocks, in other units, and from trial to trial."""
    trials = (np.tile(TIME, 3), np.tile(WAY, 3), np.tile(ANGLE, 3))
    return {
        "iso.csv": table("timestamp,drive_mm,angle_deg", rows(clock("%Y-%m-%dT%H:%M:%S.%fZ"))),
        "iso-space-comma.csv": table("Zeitstempel;Weg [mm];Winkel [Grad]", [
            (t.replace(".", ","), x, a) for t, x, a in rows(clock("%Y-%m-%d %H:%M:%S.%f"))], ";", decimal=","),
        "german-dates.csv": table("Zeit;drive_mm;angle_deg", rows(clock("%d.%m.%Y %H:%M:%S,%f")), ";", decimal=","),
        "american-dates.csv": table("Date Time,drive_mm,angle_deg", rows(clock("%m/%d/%Y %I:%M:%S.%f %p", 0.05))),
        "time-of-day.csv": table("Date,Time,drive_mm,angle_deg",
                                 zip(["2026-05-03"] * 37, clock("%H:%M:%S.%f"), WAY, ANGLE, strict=True)),
        "whole-seconds.csv": table("timestamp,drive_mm,angle_deg", rows(clock("%Y-%m-%d %H:%M:%S"))),
        "milliseconds.csv": table("t_ms,drive_mm,angle_deg", rows(1e3 * TIME)),
        "milliseconds-not-said.csv": table("time,drive_mm,angle_deg", rows(1e3 * TIME)),
        "minutes.csv": table("time (min),drive_mm,angle_deg", rows(TIME / 60)),
        "clock-in-ms.csv": table("timestamp,drive_mm,angle_deg",
                                 rows([f"{1777852797000 + 250 * i}" for i in range(37)])),
        "clock-in-ns.csv": table("stamp,drive_mm,angle_deg",
                                 rows([f"{1777852797000000000 + 250000000 * i}" for i in range(37)])),
        "trials-restart.csv": table("trial,time_s,drive_mm,angle_deg", zip(TRIAL, *trials, strict=True)),
        "trials-restart-without-numbers.csv": table("time_s,drive_mm,angle_deg", zip(*trials, strict=True)),
        "trials-of-one-cycle.csv": table("trial,drive_mm,angle_deg", zip(
            np.repeat([1, 2, 3], 17), np.tile(WAY[4:21], 3), np.tile(ANGLE[4:21], 3), strict=True)),
        "newest-first.csv": table("time_s,drive_mm,angle_deg", reversed(list(rows()))),
        "out-of-order.csv": table("time_s,drive_mm,angle_deg", rows(np.r_[TIME[:9], TIME[10], TIME[9], TIME[11:]])),
        "hours-and-minutes.csv": table("time,drive_mm,angle_deg", rows([f"12:{i:02d}" for i in range(37)])),
        "cycle-falls.csv": table("cycle,drive_mm,angle_deg", zip(np.tile([1, 2], 19)[:37], WAY, ANGLE, strict=True)),
        "steps-of-command.csv": table("time_s,drive_mm,angle_deg", zip(
            0.01 * np.arange(240), np.repeat([0, 2, 0, -2, 0, 2], 40),
            np.concatenate([a + (b - a) * (1 - np.exp(-np.arange(40) / 6)) for a, b in
                            ((0, 0), (0, 40), (40, 1), (1, -40), (-40, -1), (-1, 40))]).round(4), strict=True)),
    }  # fmt: skip


def units() -> dict[str, str]:
    """Columns in other units, and columns that are neither a drive nor an angle."""
    found = {}
    of_turn = {"angle_turns": 1 / 360, "bend_rev": 1 / 360, "tip_angle_gon": 1 / 0.9}
    for name, factor in {"angle_rad": np.pi / 180, "theta_mrad": np.pi / 0.18, **of_turn}.items():
        found[f"{name.replace('_', '-')}.csv"] = table(f"time_s,drive_mm,{name}", rows(TIME, WAY, factor * ANGLE))
    for name in ("tau_Nm", "load_kN", "force_N", "volt_V", "strain_pct", "angle_ticks", "enc_counts", "temp_C"):
        found[f"no-angle-{name.replace('_', '-')}.csv"] = table(f"time_s,drive_mm,{name}", rows())
    of_steps = {"volt_V": 1, "pwm": 100, "enc_counts": 1000, "motor_steps": 200}
    of_length = {"stroke_in": 1 / 25.4, "stage_um": 1e3, "drive_cm": 0.1}
    of_turn = {"wheel_turns": 1 / 360, "motor_rad": np.pi / 180}
    for name, factor in (of_length | of_turn | of_steps).items():
        found[f"drive-{name.replace('_', '-')}.csv"] = table(f"time_s,{name},angle_deg", rows(TIME, factor * WAY))
    for name in ("motor_torque_Nm", "motor_current_A", "wheel_speed_mm_s"):
        found[f"no-drive-{name.replace('_', '-')}.csv"] = table(f"time_s,{name},angle_deg", rows())
    pull = np.abs(WAY)
    return found | {
        "force-kN.csv": table("time_s,tendon_force_kN,angle_deg", rows(TIME, 1e-3 * pull)),
        "force-gf.csv": table("time_s,tendon_force_gf,angle_deg", rows(TIME, pull / 9.80665e-3)),
        "load-cell-grams.csv": table("time_s,load cell [g],angle_deg", rows(TIME, pull / 9.80665e-3)),
        "wrapped-360.csv": table("time_s,drive_mm,angle_deg", rows(TIME, WAY, ANGLE % 360)),
        "wrapped-180.csv": table("time_s,drive_mm,angle_deg", rows(TIME, WAY, (ANGLE + 360) % 360 - 180)),
        "wrapped-rad.csv": table("time_s,drive_mm,angle_rad", rows(TIME, WAY, np.radians(ANGLE % 360))),
        "no-units.csv": table("time,drive,angle", rows()),
        "no-units-rad.csv": table("time,drive,theta", rows(TIME, WAY, np.radians(ANGLE))),
        "encoder-alone.csv": table("time_s,encoder,angle_deg", rows(TIME, 1000 * WAY)),
        "no-units-long.csv": table("time_s,stage,angle_deg", rows(TIME, 1000 * WAY)),
        "no-angle-theta-dot.csv": table("time_s,drive_mm,theta_dot", rows()),
        "two-drives.csv": table("time_s,motor_a_mm,motor_b_mm,angle_deg", rows(TIME, WAY, -WAY, ANGLE)),
        "drive-and-its-current.csv": table("time_s,motor_mm,motor_current_A,angle_deg", rows(TIME, WAY, -WAY, ANGLE)),
        "names-nobody-knows.csv": table("a,b,c", rows()),
        "camel-case.csv": table("timeMs,driveMm,angleRad", rows(1e3 * TIME, WAY, np.radians(ANGLE))),
        "spoken-units.csv": table("Time in ms,Stage travel / um,Tip angle (°)", rows(1e3 * TIME, 1e3 * WAY)),
    }


def holes() -> dict[str, str]:
    """Rows without a number."""
    odd = lambda i: i % 3 != 1  # noqa: E731
    return {
        "empty-angles.csv": table("time_s,drive_mm,angle_deg", rows(TIME, WAY, only(ANGLE, odd))),
        "nan-words.csv": table("time_s,drive_mm,angle_deg", rows(TIME, WAY, only(ANGLE, odd, "NaN"))),
        "na-words.csv": table("time_s,drive_mm,angle_deg", rows(TIME, only(WAY, odd, "#N/A"), ANGLE)),
        "lines-of-commas.csv": table("time_s,drive_mm,angle_deg", rows()) + ",,\n" * 30,
        "two-rates-one-table.csv": table("time_s,drive_mm,angle_deg", rows(
            TIME, only(WAY, lambda i: i % 2 == 0), only(ANGLE, lambda i: i % 2 == 1))),
        "infinite.csv": table("time_s,drive_mm,angle_deg", rows(TIME, WAY, only(ANGLE, lambda i: i != 9, "inf"))),
        "text-in-a-cell.csv": table("time_s,drive_mm,angle_deg",
                                    rows(TIME, WAY, only(ANGLE, lambda i: i != 9, "error 3"))),
    }  # fmt: skip


def of_ros() -> dict[str, str]:
    """A bag of ROS 2 exported as CSV: nested names, stamps of two columns."""
    stamps = [(1777852797 + int(t), round(1e9 * (t % 1))) for t in TIME]
    sec, nano = ([one[k] for one in stamps] for k in (0, 1))
    own = "header.stamp.sec,header.stamp.nanosec,/stage/displacement_mm,/tip/angle_rad"
    joints = "/joint_states/header.stamp.sec,/joint_states/header.stamp.nanosec,"
    joints += "/joint_states/position[0],/joint_states/position[1],/joint_states/velocity[0],/joint_states/effort[0]"
    cells = list(zip(map(str, sec), map(str, nano), WAY, np.radians(ANGLE), strict=True))
    return {
        "ros2-own-names.csv": table(own, cells),
        "ros2-joint-states.csv": table(joints, [(*row, 0, 0) for row in cells]),
        "ros1-secs.csv": table("field.header.stamp.secs,field.header.stamp.nsecs,field.drive_mm,field.angle_deg",
                               [(*row[:3], np.degrees(row[3])) for row in cells]),
        "plotjuggler.csv": table("__time,/stage/displacement_mm,/tip/angle_deg", rows()),
    }  # fmt: skip


def of_programs() -> dict[str, str]:
    """Files of LabVIEW, of a testing machine, of a camera system, of ROS 1, R and pandas; names in other scripts."""
    lvm = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\t\n"
    lvm += "Channels\t2\t\t\t\nSamples\t37\t37\t\t\nDate\t2026/05/03\t2026/05/03\t\t\nX0\t0.0E+0\t0.0E+0\t\t\n"
    lvm += "Delta_X\t0.25\t0.25\t\t\n***End_of_Header***\t\t\t\t\n"
    machine = '"Specimen label","A1"\n\n"Time","Extension","Load","Bend angle"\n"(s)","(mm)","(N)","(deg)"\n'
    nanos = [f"{1777852797000000000 + 250000000 * i}" for i in range(37)]
    quoted = [[f'"{number(cell)}"' for cell in row] for row in rows(TIME, WAY, np.full(37, 3.5), ANGLE)]
    camera = "Format Version,1.23,Take Name,Take 2,Rate,4\n\n,,Rigid Body,Rigid Body\n"
    return {
        "labview.lvm": lvm + table("X_Value\tStage travel (mm)\tTip angle (deg)\tComment",
                                   rows(TIME, WAY, ANGLE, [""] * 37), "\t"),
        "testing-machine.csv": machine + table(None, quoted),
        "camera-system.csv": camera + table("Frame,Time (Seconds),Stage X (mm),Bend (deg)",
                                            zip(range(37), TIME, WAY, ANGLE, strict=True)),
        "rostopic-echo.csv": table("%time,field.header.seq,field.header.stamp,field.stage_mm,field.angle_deg",
                                   zip(nanos, range(37), nanos, WAY, ANGLE, strict=True)),
        "pandas-index.csv": table(",time_s,drive_mm,angle_deg", zip(range(37), TIME, WAY, ANGLE, strict=True)),
        "r-row-names.txt": table('"time_s" "drive_mm" "angle_deg"',
                                 zip([f'"{i}"' for i in range(37)], TIME, WAY, ANGLE, strict=True), " "),
        "types-and-units.csv": table("Time,Drive,Angle\nfloat64,float64,float64\ns,mm,deg", rows()),
        "numbered-columns.csv": table("Time,Drive mm,Angle deg\n1,2,3", rows()),
        "trials-in-words.csv": table("trial,drive_mm,angle_deg",
                                     zip([f"run {1 + i // 20}" for i in range(37)], WAY, ANGLE, strict=True)),
        "units-in-cells.csv": table("time,drive,angle", [(f"{t} s", f"{x} mm", f"{a} deg") for t, x, a in rows()]),
        "keys-and-values.txt": "".join(f"drive: {x} angle: {a}\n" for _, x, a in rows()),
        "yaw-pitch-roll.csv": table("t,drive_mm,yaw_deg,pitch_deg,roll_deg", rows(TIME, WAY, ANGLE, 0 * WAY, 0 * WAY)),
        "only-the-motor-turns.csv": table("t,stage_mm,motor_angle_deg", rows()),
        "only-the-tip-moves.csv": table("t,tip_position_mm,angle_deg", rows()),
        "spike-and-wrapped.csv": table("t,drive_mm,angle_deg", rows(TIME, WAY, np.where(TIME == 5, 999, ANGLE % 360))),
        "chinese.csv": table("时间(s),位移(mm),角度(°)", rows()),
        "greek.csv": table("t,x_mm,θ_°", rows()),
        "drive-stands-still.csv": table("t,force_N,angle_deg", rows(TIME, np.full(37, 3.5))),
    }  # fmt: skip


def of_monitors() -> dict[str, str]:
    """Lines of a serial monitor: labels before the numbers, stamps before an arrow."""
    labels = [f"pos: {x} mm, angle: {a} deg" for _, x, a in rows()]
    stamps = [f"{t[:12]} -> {x},{a}" for t, (_, x, a) in zip(clock("%H:%M:%S.%f"), rows(), strict=True)]
    return {
        "labels-and-units.txt": "\n".join(labels) + "\n",
        "labels-cut-off.txt": "\n".join(["5 mm, angle: -9.5 deg", *labels, "pos: 2 mm, an"]),
        "labels-that-change.txt": "\n".join([*labels[:20], "speed: 3, angle: 4", *labels[20:]]) + "\n",
        "stamps-and-arrow.txt": "\n".join(["23:59:56.900 -> pos_mm,angle_deg", *stamps]) + "\n",
    }


def of_spreadsheets() -> dict[str, str]:
    """Means above, below and aside, buffers that were not filled, tables of several specimens, frames."""
    head = "time_s,drive_mm,angle_deg"
    grid, body = table(head, rows()), table(None, rows())
    bars = "".join(f"| {t} | {x} | {a} |\n" for t, x, a in rows())
    three = [f"{t:.3f},{x:.3f},{a:.3f}" for t, x, a in rows()]
    halves = np.repeat([10, 20], [20, 17])
    return {
        "means-above.csv": f"{head}\nmean,0.1,0.2\nstd,1.4,27\n{body}",
        "means-below.csv": table("drive_mm,angle_deg,", zip(WAY, ANGLE, [""] * 37, strict=True)) + "0.1,0.2,mean\n",
        "mean-without-a-word.csv": table("drive_mm,angle_deg", zip(WAY, ANGLE, strict=True)) + "\n0.11,0.22\n",
        "a-pause-before-the-end.csv": grid.replace("\n8.5,", "\n\n8.5,"),
        "words-in-the-last-row.csv": table(f"{head},event", rows(TIME, WAY, ANGLE, [""] * 36 + ["max"])),
        "words-of-a-run.csv": "A\n" + table(f"run,{head}", zip(["A"] * 37, TIME, WAY, ANGLE, strict=True)),
        "zeros-at-the-end.csv": grid + "0,0,0\n" * 4,
        "last-number-cut.csv": "\n".join([head, *three])[:-2].replace(",", ";"),
        "names-in-a-line-above.csv": f"Time,Drive,Angle\ns,mm,deg\nrun 1,run 1,run 1\n{body}",
        "markdown.md": f"| time_s | drive_mm | angle_deg |\n|---:|---:|---:|\n{bars}",
        "framed.txt": f"+---+---+---+\n| time_s | drive_mm | angle_deg |\n+---+---+---+\n{bars}+---+---+---+\n",
        "r-numbers-of-rows.txt": table('"time_s" "drive_mm" "angle_deg"',
                                       zip([f'"{i + 1}"' for i in range(37)], TIME, WAY, ANGLE, strict=True), " "),
        "numbered-and-trailing.csv": table("n,drive_mm,angle_deg",
                                           zip(range(1, 38), WAY, ANGLE, [""] * 37, strict=True)),
        "comma-and-tab.csv": table("time_s,\tdrive_mm,\tangle_deg", [(f"{t:.3f}", f"{x:.3f}", f"{a:.3f}")
                                                                    for t, x, a in rows()], ",\t"),
        "full-width-digits.csv": grid.translate({ord(c): 0xFEE0 + ord(c) for c in "0123456789.-"}).replace(
            head.translate({ord("-"): 0xFF0D}), head),
        "en-dash.csv": grid.replace("-", "\u2013"),
        "overloads.csv": table(head, rows(TIME, WAY, only(ANGLE, lambda i: i % 3 != 1, "OVLD"))),
        "fortran-stars.csv": table(head, rows(TIME, WAY, only(ANGLE, lambda i: i % 3 != 1, "********"))),
        "two-preloads.csv": table(f"preload_N,{head}", zip(halves, TIME, WAY, ANGLE, strict=True)),
        "preload-drifts.csv": table(f"preload_N,{head}", zip(halves / 100 + 9.9, TIME, WAY, ANGLE, strict=True)),
        "second-table.csv": grid + "time_s,angle_deg,drive_mm\n" + table(None, rows(TIME + 10, ANGLE, WAY)),
        "begun-anew.csv": f"Bench 3\nDate,2026-05-03\nGain,x,2\nSample,4 per s\n{grid}" * 2,
        "begun-anew-otherwise.csv": "".join(
            f"Bench 3\nGain,x,{k}\nFilter,off\nRate,4 per s\nA,B\n{grid}" for k in (2, 3)),
    }  # fmt: skip


def of_channels() -> dict[str, str]:
    """LabVIEW with the units above the names, without times, and begun anew."""
    head = "Channels\t2\t\t\nDate\t2026/05/03\t2026/05/03\t\nY_Unit_Label\tcm\trad\t\n"
    head += "X0\t0.0E+0\t0.0E+0\t\n***End_of_Header***\t\t\t\nX_Value\tStage\tBend\tComment\n"
    grid = list(rows(TIME, WAY / 10, np.radians(ANGLE)))
    parts = [table(None, grid[:20], "\t"), table(None, grid[20:], "\t")]
    return {
        "labview-units-above.lvm": head + table(None, grid, "\t"),
        "labview-without-times.lvm": head + table(None, [("", *row[1:]) for row in grid], "\t"),
        "labview-with-a-comment.lvm": head
        + table(None, [(*row, "start")[: 4 if i == 0 else 3] for i, row in enumerate(grid)], "\t"),
        "labview-begun-anew.lvm": f"{head}{parts[0]}\n{head.replace('05/03', '05/04')}{parts[1]}",
    }


def more_times() -> dict[str, str]:
    """Dates with months in letters or without marks, and days as spreadsheets count them."""
    days = [f"{46145.999965 + t / 86400:.12f}" for t in TIME]
    return {
        "dates-with-months.csv": table("Time,drive_mm,angle_deg", rows(clock("%d-%b-%Y %H:%M:%S.%f"))),
        "dates-of-c.csv": table("Time,drive_mm,angle_deg", rows(clock("%a %b %d %H:%M:%S.%f %Y"))),
        "dates-without-marks.csv": table("Time,drive_mm,angle_deg", rows(clock("%Y%m%dT%H%M%S.%f"))),
        "days.csv": table("Time,drive_mm,angle_deg", rows(days)),
    }


def more_units() -> dict[str, str]:
    """Units that are rare, multiples, unknown, said twice, or not said; names in other languages."""
    pull = np.abs(WAY)
    drive = {"mil": WAY / 0.0254, "dm": WAY / 100, "0.01 mm": 100 * WAY, "mm x10": 10 * WAY, "furl": WAY}
    found = {f"drive-in-{name.replace(' ', '-')}.csv": table(f"time_s,Drive [{name}],angle_deg", rows(TIME, values))
             for name, values in drive.items()}  # fmt: skip
    return found | {
        "force-daN.csv": table("time_s,load (daN),angle_deg", rows(TIME, 0.1 * pull)),
        "angle-cdeg.csv": table("time_s,drive_mm,angle_cdeg", rows(TIME, WAY, 100 * ANGLE)),
        "angle-in-pi.csv": table("time_s,drive_mm,angle (pi rad)", rows(TIME, WAY, ANGLE / 180)),
        "tangent-of-angle.csv": table("time_s,drive_mm,tan(angle)", rows(TIME, WAY, np.tan(np.radians(ANGLE)))),
        "motor-angle-without-a-unit.csv": table("time_s,motor_theta,tip_angle_deg", rows(TIME, 10 * WAY)),
        "bend-of-the-motor.csv": table("time_s,theta_m,tip_angle_deg", rows(TIME, 10 * WAY)),
        "inches-or-input.csv": table("time_s,drive_in,angle_out", rows()),
        "units-twice.csv": table("time_s,drive_mm,angle_deg\ns,um,deg", rows()),
        "servo-pulse.csv": table("time_s,servo_us,angle_deg", rows(TIME, 1500 + 100 * WAY)),
        "label-in-brackets.csv": table("time_s,Drive (M1),Angle (IMU)", rows()),
        "italian.csv": table("Tempo [s];Spostamento [mm];Angolo [gradi]", rows(), ";", decimal=","),
        "portuguese.csv": table("Tempo (s);Deslocamento (mm);Ângulo (graus)", rows(), ";", decimal=","),
        "dutch.csv": table("Tijd (s);Verplaatsing (mm);Hoek (graden)", rows(), ";", decimal=","),
        "spanish-force.csv": table("tiempo;fuerza (N);ángulo (grados)", rows(TIME, pull), ";", decimal=","),
        "japanese.csv": table("時間(秒),変位(mm),角度(度)", rows()),
    }


def files() -> dict[str, bytes]:
    """Give all files: name -> content."""
    texts = plain() | times() | units() | holes() | of_ros() | of_programs()
    texts |= of_monitors() | of_spreadsheets() | of_channels() | more_times() | more_units()
    found = {name: text.encode() for name, text in texts.items()}
    degrees = table("Zeit [s];Weg [µm];Winkel [°]", rows(TIME, 1e3 * WAY), ";", decimal=",")
    grid = texts["plain.csv"]
    return found | {
        "cp1252.csv": degrees.encode("cp1252"),
        "latin-1-smart.csv": f"# {chr(0x81)}\n{degrees}".encode("latin-1"),
        "utf-8-bom.csv": b"\xef\xbb\xbf" + grid.encode(),
        "utf-16-bom.csv": degrees.encode("utf-16"),
        "utf-16-be-bom.csv": b"\xfe\xff" + grid.encode("utf-16-be"),
        "utf-16-without-bom.csv": grid.encode("utf-16-le"),
        "excel-unicode-text.txt": b"\xff\xfe" + degrees.replace(";", "\t").replace("\n", "\r\n").encode("utf-16-le"),
        "gb18030.csv": texts["chinese.csv"].encode("gb18030"),
        "nul-bytes.csv": grid.encode().replace(b"\n2,", b"\n\0,"),
        "empty.csv": b"",
        "old-spreadsheet.xls": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(64),
        "matlab-7.3.mat": b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n",
        "labview.tdms": b"TDSm" + bytes(64),
        "bag.db3": b"SQLite format 3\0" + bytes(64),
        "packed.csv.gz": b"\x1f\x8b\x08" + bytes(32),
        "packed.csv.xz": b"\xfd7zXZ\0" + bytes(32),
        "frame.pkl": b"\x80\x04\x95" + bytes(32),
        "records.json": b'{\n "drive_mm": [0, 0.5, 1],\n "angle_deg": [-0.5, 9.5, 19.5]\n}\n',
        "page.xls": b"<html><table><tr><td>drive_mm</td><td>angle_deg</td></tr></table></html>\n",
        "names-in-angle-brackets.csv": grid.replace(
            "time_s,drive_mm,angle_deg", "<time_s>,<drive_mm>,<angle_deg>"
        ).encode(),
    }


def main() -> None:
    """Write all files."""
    FOLDER.mkdir(exist_ok=True)
    for name, content in files().items():
        (FOLDER / name).write_bytes(content)


if __name__ == "__main__":
    main()
