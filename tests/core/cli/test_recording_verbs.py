"""import, inspect and record, as a person calls them."""

import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from tactbench.core.recording.reader import read_meta
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tests.core.cli.test_screens import assert_one_clear_screen

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
    shown = dict(re.split("  +", line, maxsplit=1) for line in done.stdout.splitlines())
    assert (shown["recordings"], shown["rows"], shown["files"]) == ("2", "100", "2")
    assert next(value for name, value in shown.items() if name.endswith("sample")).split() == ["fz", "=", "50"]
    assert "b constant (in 2 recordings)" in done.stdout
    assert "importing" in done.stderr
    about = json.loads(tables("inspect", "recordings/one.h5", "recordings/two.h5", "--format", "json").stdout)
    assert [one["meta"]["name"] for one in about] == ["one", "two"]
    assert {finding["check"] for finding in about[0]["findings"]} == {"stuck", "missing"}
    assert about[0]["content_sha256"] != about[1]["content_sha256"]
    (taxels, scale) = about[0]["streams"]
    assert (taxels["of"], taxels["rows"], taxels["channels"]) == (
        "sensor", 50, [{"kind": "taxel", "unit": "count", "names": ["a", "b"]}],
    )  # fmt: skip
    assert (scale["seconds"], scale["mean_rate_hz"]) == pytest.approx((0.49, 100.0))
    assert "(verified)" in tables("inspect", "recordings/one.h5").stdout


def test_an_error_in_the_data_is_an_exit_code(tables):
    with (tables.folder / "two.csv").open("a") as two:
        two.write("0.1,1,1,2\n")
    assert "backwards" in tables("import", "mapping.yaml", "--out", "recordings", code=1).stdout
    assert "backwards" in tables("inspect", "recordings/two.h5", "recordings/one.h5", code=1).stdout


def test_without_what_only_posix_has(tables):
    """Not the same as Windows; but what is not there cannot be needed."""
    script = (
        "import multiprocessing, os, sys\n"
        "import psutil\n"  # its code for Linux needs resource
        "sys.modules.update(dict.fromkeys(('fcntl', 'resource', 'termios', 'pwd')))\n"
        "for name in ('fork', 'killpg', 'sched_getaffinity'):\n    delattr(os, name)\n"
        "multiprocessing.set_start_method('spawn')\n"
        "from tactbench.core.cli import cli\n"
        "for words in ('import mapping.yaml --out recordings', 'record --sensor ideal --profile ramp:duration=3 "
        "--out press.h5', 'inspect recordings/one.h5 press.h5'):\n"
        "    cli.main(words.split(), standalone_mode=False)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tables.folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tables.folder / "press.h5").exists()


def test_record_then_inspect(verbs):
    verbs("record", "--sensor", "icub", "--indenter", "cap:radius=10", "--profile", "ramp:force=2", "--out", "press.h5")
    assert "exists already" in verbs("record", "--sensor", "icub", "--out", "press.h5", code=2).stderr
    (cap,) = json.loads(verbs("inspect", "press.h5", "--format", "json").stdout)
    assert cap["meta"]["simulated"]
    assert cap["meta"]["labels"] == {"cap_radius_mm": 10.0}
    assert cap["meta"]["scene"]["profile"]["end"]["value"] == 2.0
    assert {stream["of"] for stream in cap["streams"]} == {"sensor", "reference"}


def test_what_a_crash_left_behind(tables):
    tables("import", "mapping.yaml", "--out", "recordings")
    one = tables.folder / "recordings" / "one.h5"
    with RecordingWriter(tables.folder / "new.h5", read_meta(one)) as writer:
        writer.append(Block("taxels", np.arange(9), np.ones((9, 2))))
        writer.append(Block("scale", np.arange(9), np.ones((9, 1))))
        shutil.copy(tables.folder / "new.h5.partial", tables.folder / "left.h5.partial")
    assert "--rescue" in tables("inspect", "left.h5.partial", code=2).stderr
    assert re.search(r"sensor\s+9\s", tables("inspect", "left.h5.partial", "--salvage").stdout)
    assert re.search(r"sensor\s+9\s", tables("inspect", "left.h5.partial", "--rescue", "left.h5").stdout)
    assert read_meta(tables.folder / "left.h5").excluded


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


def test_a_log_of_a_sensor_becomes_a_recording_and_is_not_replaced_unasked(logged):
    options = ("--option", "triangle=3", "--label", "session=a", "--label", "role=test", "--label", "cap_radius_mm=4")
    log = ("import", "bus.asc", "--sensor", "icub", *options, "--out", "recordings/press.h5")
    assert re.search("rows +50\n", logged(*log).stdout)
    (about,) = json.loads(logged("inspect", "recordings/press.h5", "--format", "json").stdout)
    meta = about["meta"]
    assert (meta["rig"], meta["clock"], meta["session"], meta["role"]) == ("import", "host", "a", "test")
    assert (meta["labels"], meta["origin"]) == ({"cap_radius_mm": 4}, "bus.asc")
    assert "exists already" in logged(*log, code=2).stderr
    logged(*log, "--replace")


@pytest.mark.parametrize(
    "given", [("--sensor", "icub"), ("--sensor", "ideal"), ("--sensor", "icub", "--label", "role=x")]
)
def test_a_log_that_cannot_be_read_is_one_clear_screen(logged, given):
    """No board is named; the sensor reads no logs; a role that does not exist."""
    assert_one_clear_screen(logged("import", "bus.asc", *given, code=2))
    assert not (logged.folder / "recordings").exists()
