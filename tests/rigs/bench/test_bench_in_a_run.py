"""The bench in a matrix: rows of emulated devices stand by themselves, beside those of the twin."""

from __future__ import annotations

import json
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "rigs" / "bench-emulated.yaml"
BIOTAC = "  biotac:\n    link: emulated\n"
NET_FT = "  device: net-ft\n  link: emulated\n"
SLOWER = "  options: {rate_hz: 100.0, counts_per_newton: 1.0e+6, counts_per_newton_metre: 1.0e+6}\n"
"""A tenth of its records: a minute of them is sent and read three times."""


def test_rows_of_emulated_devices_are_ranked_with_nobody_else(shell, verbs):
    asked = ("--task", "force", "--protocol", "deployable", "--estimator", "ols", "--repeats", "1")
    asked += ("--engine", "in-process")
    text = EXAMPLE.read_text(encoding="utf-8")
    for was, becomes in ((NET_FT, NET_FT + SLOWER), (BIOTAC, "")):
        assert was in text
        text = text.replace(was, becomes)
    (shell.folder / "rig.yaml").write_text(text, encoding="utf-8")
    verbs("run", "--sensor", "icub", *asked)
    # Without --sensor it is that of the rig file.
    assert "EMULATED" in verbs("run", "--rig-file", "rig.yaml", *asked).stdout
    table = verbs("leaderboard", "--format", "md").stdout
    assert (table.count("EMULATED"), table.count("SIMULATED")) == (1, 1)
    rows = json.loads(verbs("leaderboard", "--format", "json").stdout)
    score = {row["rig"]: row["score"] for row in rows if row["estimator"] == "ols"}
    # One campaign of each, of the same samples; what differs is the zero of the force, some hundredths of a newton.
    assert abs(score["bench"] - score["twin"]) < 0.05
    assert {row["rig"]: (row["simulated"], row["emulated"]) for row in rows} == {
        "bench": (True, True),
        "twin": (True, False),
    }
    again = shell("run", "--rig-file", "rig.yaml", *asked)
    assert "0 recordings" in again.stderr


def test_a_rig_file_for_another_rig_or_none_at_all_is_refused(verbs):
    assert "--rig-file" in verbs("run", "--rig", "bench", "--sensor", "icub", "--task", "force", code=2).stderr
    refused = verbs("run", "--rig", "twin", "--rig-file", str(EXAMPLE), "--sensor", "icub", code=2).stderr
    assert "'bench'" in refused


def test_one_scene_is_recorded_and_a_terminal_is_asked_for_where_somebody_has_to_press(shell):
    made = shell(
        "record", "--rig-file", str(EXAMPLE), "--sensor", "icub", "--profile", "ramp:duration=2", "--out", "press.h5"
    )
    assert "(EMULATED)" in made.stdout
    text = EXAMPLE.read_text().replace("link: emulated", "link: udp://127.0.0.1:9", 1)
    (shell.folder / "rig.yaml").write_text(text)
    refused = shell("record", "--rig-file", "rig.yaml", "--sensor", "biotac", "--out", "none.h5", code=None)
    assert refused.returncode != 0
    assert "Traceback" not in refused.stderr
    assert not (shell.folder / "none.h5").exists()


def test_a_task_that_the_rig_has_no_reference_for_is_refused_before_anything_is_recorded(verbs, shell):
    for task, lacking in (("contact-location", "position x"), ("slip", "position slip")):
        refused = verbs("run", "--rig-file", str(EXAMPLE), "--sensor", "icub", "--task", task, code=2)
        assert lacking in refused.stderr
    assert not list(shell.folder.rglob("*.h5"))
