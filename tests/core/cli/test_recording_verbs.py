"""import, inspect and record, as a person calls them."""

import json
import subprocess
import sys

import pytest

MAPPING = """
version: 1
title: a scale
sensor: {name: pad, title: a pad, principle: capacitive, principle_source: {tag: assumed, reference: test}}
clock: host
tables:
  scale:
    files: "*.csv"
    read: {format: csv, header: true}
    time: {column: t, unit: s, epoch: start}
recording: {name: "{file}", session: "{file}"}
streams:
  taxels: {table: scale, channels: [{columns: [a, b], name: "{column}", kind: taxel, unit: count}]}
  scale:
    table: scale
    of: reference
    channels: [{columns: f, name: fz, kind: force, unit: N, given_in: gf, sentinels: [-1]}]
"""


@pytest.fixture
def tables(verbs):
    (verbs.folder / "mapping.yaml").write_text(MAPPING)
    for name in ("one", "two"):
        rows = "".join(f"{n / 100},{n},{7},{-1 if n % 2 else n}\n" for n in range(50))
        (verbs.folder / f"{name}.csv").write_text("t,a,b,f\n" + rows)
    return verbs


def test_import_then_inspect(tables):
    done = tables("import", "mapping.yaml", "--out", "recordings")
    assert "2 recordings of pad, 100 rows, from 2 files" in done.stdout
    assert "rows without a sample, marked and left out of every evaluation: fz 50" in done.stdout
    assert "warning: taxel b constant (in 2 of 2 recordings)" in done.stdout
    assert "importing" in done.stderr
    shown = tables("inspect", "recordings/one.h5").stdout
    assert "pad on import; session one; clock host" in shown
    assert "taxels (sensor): 50 rows, 100 Hz" in shown
    assert "(verified)" in shown
    about = json.loads(tables("inspect", "recordings/one.h5", "recordings/two.h5", "--format", "json").stdout)
    assert [one["meta"]["name"] for one in about] == ["one", "two"]
    assert {finding["check"] for finding in about[0]["findings"]} == {"stuck", "missing"}
    assert about[0]["content_sha256"] != about[1]["content_sha256"]


def test_a_wrong_table_is_one_clear_screen(tables):
    with (tables.folder / "two.csv").open("a") as file:
        file.write("0.6,x,1,2\n")
    done = tables("import", "mapping.yaml", code=2)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert "two.csv:52: column 'a': 'x' is not a number" in done.stderr
    assert not (tables.folder / "recordings").exists()


def test_an_import_with_errors_says_so_by_its_exit_code(tables):
    with (tables.folder / "two.csv").open("a") as file:
        file.write("0.1,1,1,2\n")
    done = tables("import", "mapping.yaml", "--out", "recordings", code=1)
    assert "error: time runs backwards" in done.stdout
    assert (tables.folder / "recordings" / "two.h5").exists()


def test_without_what_only_posix_has(tables):
    """Not the same as Windows; but what is not there cannot be needed."""
    script = (
        "import multiprocessing, os, sys\n"
        "import psutil\n"  # its code for Linux needs resource
        "sys.modules.update(dict.fromkeys(('fcntl', 'resource', 'termios', 'pwd')))\n"
        "for name in ('fork', 'killpg', 'sched_getaffinity'):\n    delattr(os, name)\n"
        "multiprocessing.set_start_method('spawn')\n"
        "from tactbench.core.cli import main\n"
        "main(sys.argv[1:])\n"
    )
    for words in (
        ("import", "mapping.yaml", "--out", "recordings"),
        ("record", "--sensor", "ideal", "--profile", "ramp:duration=3", "--out", "press.h5"),
        ("inspect", "recordings/one.h5", "press.h5"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", script, *words], cwd=tables.folder, check=False, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr


def test_a_damaged_recording(tables):
    tables("import", "mapping.yaml", "--out", "recordings")
    path = tables.folder / "recordings" / "one.h5"
    path.write_bytes(path.read_bytes()[:5000])
    done = tables("inspect", "recordings/one.h5", code=2)
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert "cut short" in done.stderr


def test_record_then_inspect(verbs):
    press = ("record", "--sensor", "icub", "--indenter", "cap:radius=10", "--profile", "ramp:force=2,duration=3")
    done = verbs(*press, "--out", "press.h5")
    assert "icub on twin (SIM), cap R 10 mm" in done.stdout
    (about,) = json.loads(verbs("inspect", "press.h5", "--format", "json").stdout)
    assert about["meta"]["simulated"]
    assert about["meta"]["labels"] == {"cap_radius_mm": 10.0}
    assert about["meta"]["scene"]["profile"]["end"]["value"] == 2.0
    assert {stream["of"] for stream in about["streams"]} == {"sensor", "reference"}
    assert "exists already" in verbs("record", "--sensor", "icub", "--out", "press.h5", code=2).stderr
    verbs(*press, "--out", "other.h5")  # the seed alone decides, and not the name of the file
    (other,) = json.loads(verbs("inspect", "other.h5", "--format", "json").stdout)
    assert (other["meta"]["name"], other["content_sha256"]) == ("other", about["content_sha256"])


def test_record_a_shape_and_a_profile_by_name(verbs):
    press = "press-hold-release:peak=2,rest=1,rate=20"
    asked = ("record", "--sensor", "ideal", "--indenter", "cylinder:radius=4,angle=90", "--profile", press)
    assert "cylinder radius 4 mm, turned by 90 deg" in verbs(*asked, "--out", "line.h5").stdout
    (about,) = json.loads(verbs("inspect", "line.h5", "--format", "json").stdout)
    assert about["meta"]["labels"] == {"indenter": "cylinder"}
    assert about["meta"]["assumptions"]["indenter radius"] == 4.0
    assert about["meta"]["scene"]["profile"]["kind"] == "path"
    assert "press-hold-release (peak 2 N" in about["meta"]["scene"]["profile"]["source"]["reference"]
    for wrong, says in (
        (("--indenter", "knob"), "Known: cap, cylinder, edge, flat, pin."),
        (("--indenter", "pin:radius=wide"), "radius of 'pin' is given as 'wide', and a number is expected"),
        (("--profile", "ramp:end=5"), "no parameter of the ramp called 'end'"),
        (("--profile", "ramp:force=0"), "force of the ramp is 0"),
    ):
        assert says in verbs("record", "--sensor", "ideal", *wrong, "--out", "no.h5", code=2).stderr


def test_what_is_pressed_and_how_is_listed_and_shown(verbs):
    assert "cylinder  Cylinder lying along x" in verbs("list", "indenters").stdout
    assert "sine                A force that swings" in verbs("list", "profiles").stdout
    shown = verbs("show", "edge", "sine", "net-ft").stdout
    assert "--indenter edge:wedge_angle=120,tip_radius=0.5" in shown
    assert "by how much, at most the mean" in shown


def test_a_rig_that_cannot_record(verbs):
    done = verbs("record", "--sensor", "icub", "--rig", "replay", "--out", "press.h5", code=2)
    assert "cannot record" in done.stderr
    assert not (verbs.folder / "press.h5").exists()


def test_what_a_crash_left_behind(tables):
    tables("import", "mapping.yaml", "--out", "recordings")
    done = tables("inspect", "recordings/one.h5", "--salvage", code=2)
    assert "without `--salvage`" in done.stderr
    script = (
        "import os, sys, numpy as np\n"
        "from pathlib import Path\n"
        "from tactbench.core.recording.reader import read_meta\n"
        "from tactbench.core.recording.writer import RecordingWriter\n"
        "from tactbench.core.samples import Block\n"
        "with RecordingWriter(Path('new.h5'), read_meta(Path('recordings/one.h5'))) as writer:\n"
        "    writer.append(Block('taxels', np.arange(9), np.ones((9, 2))))\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=tables.folder, check=False)
    assert "9 rows" in tables("inspect", "new.h5.partial", "--salvage").stdout
    assert "broke off" in tables("inspect", "new.h5.partial", "--rescue", "new.h5").stdout
    assert (tables.folder / "new.h5").exists()


@pytest.fixture
def logged(verbs):
    """A log of two fingertips: 50 samples each, every 20 ms."""
    lines = ["date Tue Nov 14 10:13:20.250 2023", "base hex  timestamps absolute", "internal events logged"]
    for number in range(50):
        for triangle in (0, 3):
            for first, data in ((0x40, [number + taxel for taxel in range(7)]), (0xC0, [90, 91, 92, 93, 94, 0, 0])):
                text = " ".join(f"{value:02X}" for value in (first, *data))
                at_s = 0.02 * number + 0.001 * triangle + 0.0002 * (first == 0xC0)
                lines.append(f"   {at_s:.6f} 1  4E{triangle:X}             Rx   d 8 {text}")
    (verbs.folder / "bus.asc").write_text("\n".join(lines) + "\n")
    return verbs


def test_a_log_of_a_sensor_becomes_a_recording(logged):
    told = ("--option", "triangle=3", "--label", "session=a", "--label", "role=test", "--label", "cap_radius_mm=4")
    done = logged("import", "bus.asc", "--sensor", "icub", *told, "--out", "recordings/press.h5")
    assert "recordings/press.h5: icub from bus.asc, 50 rows of taxels; clock host" in done.stdout
    assert "  frames of others: 100" in done.stdout
    assert "board 14, triangle 3".capitalize() in done.stdout
    (about,) = json.loads(logged("inspect", "recordings/press.h5", "--format", "json").stdout)
    meta = about["meta"]
    assert (meta["name"], meta["rig"], meta["clock"], meta["session"], meta["role"]) == (
        "press", "import", "host", "a", "test",
    )  # fmt: skip
    assert (meta["labels"], meta["origin"]) == ({"cap_radius_mm": 4}, "bus.asc")
    assert meta["counts"] == {"frames of others": 100}
    (stream,) = about["streams"]
    assert (stream["rows"], round(stream["mean_rate_hz"], 3)) == (50, 50.0)
    run = logged("run", "--rig", "replay", "--recordings", "recordings", "--sensor", "icub", "--task", "force")
    assert "no recording has it" in run.stdout  # it was found, and has no reference force


def test_a_log_that_cannot_be_read_is_one_clear_screen(logged):
    (logged.folder / "other.txt").write_text("no log")
    for given, said in (
        (("bus.asc", "--sensor", "icub"), "Choose one by the options board and triangle"),
        (("bus.asc", "--sensor", "icub", "--option", "bord=3"), "Did you mean 'board'"),
        (("bus.asc", "--sensor", "icub", "--option", "board"), "KEY=VALUE is expected"),
        (("bus.asc", "--sensor", "icub", "--out", "recordings"), "a file that ends in .h5"),
        (("bus.asc", "--sensor", "icub", "--root", "."), "--root is for mappings"),
        (("bus.asc", "--sensor", "ideal"), "has no reader for logs"),
        (("other.txt", "--sensor", "icub"), "other.txt is not a log"),
        (("nowhere.asc", "--sensor", "icub"), "There is no log nowhere.asc"),
        (("bus.asc", "--label", "session=a"), "name the --sensor"),
        (("bus.asc", "--sensor", "icub", "--label", "role=tset"), "train, validation, test is expected"),
    ):
        done = logged("import", *given, code=2)
        assert said in done.stderr
        assert done.stdout == ""
        assert "Traceback" not in done.stderr
    assert not (logged.folder / "recordings").exists()


def test_a_recording_is_not_replaced_unasked(logged):
    told = ("bus.asc", "--sensor", "icub", "--option", "triangle=0")
    logged("import", *told)
    assert "exists already" in logged("import", *told, code=2).stderr
    assert "50 rows" in logged("import", *told, "--replace").stdout
