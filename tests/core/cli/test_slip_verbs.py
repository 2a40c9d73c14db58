"""Events in time from the command line: rows, tables, why, cost and report of recordings made by hand."""

import json
import re

import pytest

from tests.conftest import Verbs
from tests.core.evaluation.made_slip import campaign

ESTIMATORS = ("--estimator", "pac-band", "--estimator", "frame-difference")
RUN = ("run", "--recordings", "made", "--task", "slip", *ESTIMATORS)


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("events"), here=True)
    folder = verbs.folder / "made"
    folder.mkdir()
    campaign(folder)
    rows = json.loads(verbs(*RUN, "--format", "json").stdout)
    return verbs, {(row["task"], row["estimator"]): row for row in rows}


def test_a_sensor_is_scored_by_all_its_streams_and_by_its_taxels(answered):
    _, rows = answered
    assert {task for task, _ in rows} == {"slip", "slip-taxels"}
    row = rows["slip", "pac-band"]
    assert (row["metric"], row["score"], row["answer_per"]) == ("event_f1", 1.0, "frame")
    assert row["answer_from"].startswith("frames of 0.1 s, one every 0.01 s; hit from 0.1 s before to 0.5 s after")
    assert row["events"]["false alarms per minute"] == 0
    # A window of 100 ms that fills with vibration, 20 ms more as the policy asks, a frame of 10 ms; then it computes.
    assert row["events"]["onset latency p50 ms"] < 130 + 10 * row["events"]["compute s per s of signal"]
    assert {point["bound"] for point in row["operating_points"]} >= {0.0, 1.0, 50.0}
    lacking = rows["slip-taxels", "pac-band"]
    assert lacking["status"] == "skipped"
    assert "band not observable above 50 Hz" in lacking["reason"]
    assert rows["slip", "slip-never"]["baseline"] == 0.0  # the oracle is no bar


def test_tables_and_pages_tell_of_events(answered):
    verbs, _ = answered
    table = verbs("leaderboard", "--wide").stdout
    assert "Events, at the threshold that validation recordings chose" in table
    assert " oracle  " in table
    why = verbs("why", "made/slip/replay/deployable/pac-band").stdout
    assert re.search(r"false alarms per minute +0\n", why)
    assert "threshold" in why
    verbs("report")


def test_detectors_are_timed_with_the_features_of_a_frame(answered):
    verbs, _ = answered
    chosen = ("--sensor", "made", "--recordings", "made", "--task", "slip", *ESTIMATORS)
    rows = json.loads(verbs("cost", *chosen, "--rounds", "1", "--format", "json").stdout)
    by_name = {row["estimator"]: row for row in rows}
    parts = by_name["pac-band"]["delay_parts_ms"]
    assert (parts["window"], parts["sampling"]) == (50.0, 10.0)
    assert parts["features"] > 0
