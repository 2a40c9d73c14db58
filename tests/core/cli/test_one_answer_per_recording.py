"""A stranger's task that asks one answer of each recording, from the command line to the report."""

import json

import numpy as np
import pytest

from tests.conftest import Verbs
from tests.core.evaluation.made import record
from tests.core.report.unrendered import unrendered

SESSIONS = 6


def recordings(folder, roles=("train",) * SESSIONS):
    """Two recordings a session, one of them shaken."""
    folder.mkdir()
    rng = np.random.default_rng(0)
    for number in range(2 * SESSIONS):
        X = rng.normal(number // 2, 3.0 if number % 2 else 1.0, (700, 2))
        record(folder / f"r{number:02d}.h5", X, np.ones(700), labels={"shaken": number % 2},
               session=f"s{number // 2}", role=roles[number // 2])  # fmt: skip


@pytest.fixture
def asked(tmp_path):
    recordings(tmp_path / "shaken")
    recordings(tmp_path / "in-roles", ("train", "train", "train", "validation", "test", "test"))

    def ask(*arguments, code=0):
        return Verbs(tmp_path, here=True)(*arguments, plugins=("whole",), code=code)

    return ask


def test_rows_say_what_an_answer_is_made_of_and_the_report_shows_them(asked, tmp_path):
    run = ("run", "--recordings", "shaken", "--task", "shaken", "--format", "json")
    row, trivial = json.loads(asked(*run).stdout)
    assert (row["estimator"], row["split"], row["n_test"]) == ("logistic", "session", 2 * SESSIONS)
    assert row["answer_per"] == trivial["answer_per"] == "recording"
    assert row["answer_from"] == "deviation, features by shaken_tactile.features:crest_factors"
    assert f"one answer a recording, from {row['answer_from']}" in row["remarks"]
    assert row["score"] == 1.0
    assert row["ci_method"].startswith("jackknife over 6 sessions ")
    assert row["delay_parts_ms"]["window"] == pytest.approx(6990)
    assert row["answer_delay_ms"] > 6990
    assert "0 computed now" in asked(*run).stderr
    with unrendered():
        asked("report")
    page = (tmp_path / "tactbench-results" / "report" / "index.html").read_text()
    assert f"one answer a recording, from {row['answer_from']}" in page
    shown = asked("show", "shaken").stdout
    assert "a recording, from deviation, features by" in shown


def test_a_vote_goes_with_the_papers_protocol_and_summaries_do_not(asked):
    run = ("run", "--recordings", "in-roles", "--task", "shaken-by-vote", "--protocol", "karl2016")
    (row, _) = json.loads(asked(*run, "--format", "json").stdout)
    assert (row["protocol"], row["split"], row["n_test"]) == ("karl2016", "roles", 4)
    assert row["answer_from"] == "the commonest answer of its frames"


def test_what_cannot_be_asked_says_why(asked):
    run = ("run", "--recordings", "shaken", "--task", "shaken", "--split", "in-session", "--format", "json")
    rows = json.loads(asked(*run).stdout)
    assert {row["status"] for row in rows} == {"skipped"}
    assert all("cuts recordings in time" in row["reason"] for row in rows)
    told = asked("cost", "--sensor", "made", "--recordings", "shaken", "--task", "shaken", code=2)
    assert "asks one of each recording" in told.stderr
