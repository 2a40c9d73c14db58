"""The whole way from scene to leaderboard: the paper's question of force, asked of one sensor."""

import json

import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.cli.terminals import computed

FORCE = ("run", "--repeats", "1", "--sensor", "icub", "--task", "force", "--format", "json")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("run"), here=True)
    done = verbs(*FORCE)
    return verbs, json.loads(done.stdout), done


def test_results_on_stdout_progress_on_stderr_and_files(ran):
    verbs, rows, done = ran
    assert {row["estimator"] for row in rows} == {"lasso", "ols", "boosting", "mean", "time-index"}
    assert "recording" in done.stderr
    out = verbs.folder / "tactbench-results"
    assert json.loads((out / "leaderboard.json").read_text()) == rows
    assert len((out / "leaderboard.csv").read_text().splitlines()) == 1 + len(rows)
    assert (out / "leaderboard.md").is_file()
    store = Store(out)
    assert {store.provenance(row["made_by"])["distributions"]["numpy"] for row in store.rows()}
    again = verbs(*FORCE)
    assert computed(again)[:3] == [6, 6, 0]
    assert json.loads(again.stdout) == rows


def test_a_row_says_what_is_promised(ran):
    _, rows, _ = ran
    for row in rows:
        assert {"cell", "baseline", "n_test", "peak_rss_mb", "score_beyond_floor", "answer_delay_ms"} <= set(row)
        assert (row["status"], row["simulated"], row["dagger"]) == ("done", True, True)
        assert (row["n_replicates"], row["ci_low"]) == (1, None), "one replicate carries no interval"
        assert row["latency_ms_p50"] > 0
        assert row["sim_s"] > 0
    score = {row["estimator"]: row["score"] for row in rows}
    # 4400 test samples: the standard error of an RMSE is 1/sqrt(2 n) = 1.1 %; three of them.
    (time,) = (row for row in rows if row["estimator"] == "time-index")
    assert time["reference_score"] == pytest.approx(0.6875, rel=0.033)
    assert time["metric"] == "true_rmse"
    assert time["score"] < 0.1, "it has nothing of the noise of the reference"
    assert score["time-index"] < score["lasso"] < score["mean"]
