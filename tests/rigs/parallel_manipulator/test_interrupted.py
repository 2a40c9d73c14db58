"""Ctrl-C at a terminal in the recorded part of a press: the motor is out, the recording says so, exit code 130."""

import os
import re

from tactbench.core.recording.reader import open_recording
from tests.core.cli.terminals import on_terminal, plain
from tests.rigs.parallel_manipulator.spring import EXAMPLE

RECORD = ["-m", "tactbench", "record", "--rig-file=rig.yaml", "--sensor=icub", "--profile=ramp:duration=8", "--live"]
SHOWN = re.compile(r"([\d.]+) of 8\.0 s")


def test_ctrl_c_in_the_recorded_part(tmp_path):
    own = EXAMPLE.read_text(encoding="utf-8")
    (tmp_path / "rig.yaml").write_text(own.replace("settle_s: 8.0", "settle_s: 0.5"), encoding="utf-8")
    with on_terminal([*RECORD, "--out", "press.h5"], columns=120, cwd=tmp_path) as terminal:
        for _ in range(200):
            shown = SHOWN.findall(plain(terminal.seen))
            if shown and float(shown[-1]) > 4.0:
                break
            terminal.read_until(" s", 1)
        for _ in range(3):
            os.write(terminal.ours, b"\x03")
        said = terminal.read_until(None, 30)
        assert terminal.process.wait(60) == 130
    assert "press.h5" in said
    assert "Traceback" not in terminal.seen
    with open_recording(tmp_path / "press.h5") as recording:
        recording.verify()
        meta, force_n = recording.meta, recording.read("force_torque").data[:, 2]
    assert meta.excluded.startswith("interrupted")
    # It was pressed when it was interrupted.
    assert force_n[-20:].mean() > 0.5
    names = sorted((name for name in meta.drawn if name.startswith("event")), key=lambda name: int(name.split()[-1]))
    events = [meta.drawn[name] for name in names]
    assert [text.split(": ")[0].split()[-1] for text in events[-2:]] == ["retreating", "retreated"]
