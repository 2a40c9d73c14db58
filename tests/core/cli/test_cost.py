"""``cost --sensor S --task T`` as a person meets it."""

import csv
import io
import json

import pytest

from tests.conftest import Verbs
from tests.core.cli.test_screens import assert_one_clear_screen
from tests.core.cost.test_ladder import presses

ASKED = ("cost", "--sensor", "made", "--task", "force", "--recordings", "shelf", "--rounds", "2")
CLUMSY = tuple(word for name in ("breaks", "tires", "lacks", "wavers", "ols") for word in ("--estimator", name))


def test_whoever_breaks_costs_its_own_row_only(shell):
    presses(shell.folder / "shelf")
    done = shell(*ASKED, *CLUMSY, "--format", "json", plugins=("clumsy",))
    rows = {row["estimator"]: row for row in json.loads(done.stdout)}
    assert rows["ols"]["status"] == "done"
    assert rows["ols"]["front_fit"]
    assert (rows["breaks"]["status"], rows["breaks"]["score"]) == ("failed", None)
    assert "out of breath" in rows["breaks"]["reason"]
    assert (rows["lacks"]["status"], rows["lacks"]["reason"]) == ("skipped", "needs a licence that nobody has")
    assert rows["tires"]["status"] == "failed"
    assert json.loads((shell.folder / "tactbench-results/cost/made-force.json").read_text())["rows"]
    assert "timing: " in done.stderr
    again = Verbs(shell.folder, here=True)(*ASKED, "--estimator", "ols", "--rounds", "1", "--format", "csv")
    listed = list(csv.DictReader(io.StringIO(again.stdout)))
    assert {row["estimator"] for row in listed} == {"ols", "mean", "time-index"}
    assert all(float(row["answer_delay_ms"]) > 0 for row in listed)


def test_what_is_timed_adds_no_row_to_a_leaderboard_and_what_a_run_has_finished_is_not_done_again(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    presses(verbs.folder / "shelf")
    asked = ("--sensor", "made", "--task", "force", "--recordings", "shelf", "--out", "out")
    verbs("run", *asked, "--estimator", "ols")
    before = verbs("leaderboard", "out", "--format", "json").stdout
    cells = {path: path.read_bytes() for path in (verbs.folder / "out" / "cells").iterdir()}
    verbs("cost", *asked, "--rounds", "1", "--estimator", "ols", "--estimator", "knn")
    assert verbs("leaderboard", "out", "--format", "json").stdout == before
    assert {path: path.read_bytes() for path in (verbs.folder / "out" / "cells").iterdir()} == cells
    rows = json.loads(verbs("leaderboard", "out/cost", "--format", "json").stdout)
    assert {row["estimator"] for row in rows} == {"ols", "knn", "mean", "time-index"}
    made_by = {row["estimator"]: row["made_by"] for row in json.loads(before)}
    wall = {row["estimator"]: row["wall_s"] for row in json.loads(before)}
    for row in rows:
        if row["estimator"] in made_by:
            assert (row["made_by"], row["wall_s"]) == (made_by[row["estimator"]], wall[row["estimator"]])


def test_the_table_states_what_its_times_mean(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    presses(verbs.folder / "shelf")
    done = verbs(*ASKED, "--estimator", "ols", "--estimator", "knn", "--out", "there")
    assert "made, force: RMSE, lower is better · deployable · split session · 2 rounds, 1 thread" in done.stdout
    (line,) = [line for line in done.stdout.splitlines() if line.strip().startswith("ols")]
    assert "fit, delay" in line
    assert "Link delay unknown" in done.stderr
    assert "mean (trivial)" in done.stdout
    assert all(
        (verbs.folder / "there" / "cost" / f"made-force.{end}").exists() for end in ("json", "csv", "png", "pdf")
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("cost", "--sensor", "icub"), "--task NAME"),
        (("cost", "--task", "force"), "--sensor NAME"),
        (("cost", "--sensor", "icub", "--sensor", "biotac", "--task", "force"), "one of each"),
        (("cost", "--sensor", "icub", "--task", "forse"), "Did you mean 'force'"),
        (("cost", "--sensor", "icub", "--task", "force", "--estimator", "laso"), "Did you mean 'lasso'"),
        (("cost", "--sensor", "icub", "--task", "force", "--estimator", "logistic"), "classification"),
        (("cost", "--sensor", "icub", "--task", "force", "--protocol", "karl2015"), "Did you mean 'karl2016'"),
        (("cost", "--twin", "--task", "forse"), "Did you mean 'force'"),
        (("cost", "--twin", "--estimator", "ols"), "Leave the others out"),
    ],
)
def test_wrong_words_are_answered_with_the_next_step(verbs, arguments, says):
    assert_one_clear_screen(verbs(*arguments, code=2), says)
