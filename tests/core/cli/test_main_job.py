"""The whole way from scene to leaderboard, as a person runs it; cheap estimators keep it quick."""

import json

import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tests.conftest import Verbs

FORCE = ("run", "--repeats", "1", "--sensor", "icub", "--task", "force")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("run"), here=True)
    done = verbs(*FORCE, "--format", "json")
    return verbs, json.loads(done.stdout), done


def test_results_on_stdout_progress_on_stderr_and_files(ran):
    verbs, rows, done = ran
    assert {row["estimator"] for row in rows} == {"lasso", "ols", "boosting", "mean", "time-index"}
    assert "recording" in done.stderr
    out = verbs.folder / "tactbench-results"
    assert json.loads((out / "leaderboard.json").read_text()) == rows
    assert len((out / "leaderboard.csv").read_text().splitlines()) == 1 + len(rows)
    assert "|  | icub | time-index |" in (out / "leaderboard.md").read_text()
    store = Store(out)
    assert {store.provenance(row["made_by"])["distributions"]["numpy"] for row in store.rows()}
    assert not list(out.rglob("*.partial"))
    again = verbs(*FORCE, "--format", "json")
    assert "6 of 6 answers were found finished, 0 computed now" in again.stderr
    assert json.loads(again.stdout) == rows


def test_a_row_says_what_is_promised(ran):
    _, rows, _ = ran
    keys = {
        *("cell", "sensor", "task", "rig", "protocol", "estimator", "repeats", "status", "reason", "metric", "score"),
        *("ci_low", "ci_high", "baseline", "n_recordings", "n_test", "sim_s", "fit_s", "n_replicates"),
        *("latency_ms_p50", "latency_ms_p95", "peak_rss_mb", "replicate_scores", "reference_floor"),
        *("score_beyond_floor", "answer_delay_ms"),
    }
    for row in rows:
        assert keys <= set(row)
        assert (row["status"], row["simulated"], row["dagger"]) == ("done", True, True)
        assert (row["n_replicates"], row["ci_low"]) == (1, None), "one replicate carries no interval"
        assert row["latency_ms_p50"] > 0
        assert row["sim_s"] > 0
    (lasso,) = [row for row in rows if row["estimator"] == "lasso" and not row["params"]]
    assert lasso["published"] == 0.7659
    assert {"placement_scatter_mm", "drift_scale", "noise_scale"} <= set(lasso["assumptions"])
    score = {row["estimator"]: row["score"] for row in rows}
    # 4400 test samples: the standard error of an RMSE is 1/sqrt(2 n) = 1.1 %; three of them.
    assert score["time-index"] == pytest.approx(0.6875, rel=0.033)
    assert score["time-index"] < score["lasso"] < score["mean"]


def test_the_same_seed_gives_the_same_scores_serially_and_with_two_jobs(ran):
    verbs, rows, _ = ran
    Verbs(verbs.folder)(*FORCE, "--jobs", "2", "--out", "parallel")
    serial, parallel = (
        [{name: row[name] for name in SEED_DECIDES} for row in Store(verbs.folder / out).rows()]
        for out in ("tactbench-results", "parallel")
    )
    assert parallel == serial
    other = json.loads(verbs(*FORCE, "--estimator", "ols", "--seed", "2", "--out", "other", "--format", "json").stdout)
    before = {row["estimator"]: row["score"] for row in rows}
    assert all(row["score"] != before[row["estimator"]] for row in other)


def test_a_cell_that_fails_is_a_row_and_stops_no_other(ran):
    verbs, _, _ = ran
    for path in (verbs.folder / "tactbench-results" / "recordings" / "icub").glob("flat-test-*.h5"):
        damaged = path.read_bytes()[:2000]
        path.unlink()
        path.write_bytes(damaged)
    asked = ("--sensor", "icub", "--sensor", "ideal", "--task", "force", "--estimator", "ols")
    done = Verbs(verbs.folder)("run", "--repeats", "1", *asked, "--format", "json", code=1)
    found = {(row["sensor"], row["status"]) for row in json.loads(done.stdout)}
    assert found == {("icub", "failed"), ("ideal", "done")}
    assert "flat-test" in done.stderr
