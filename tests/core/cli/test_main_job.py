"""The whole way from scene to leaderboard, as a person runs it; cheap estimators keep it quick."""

import csv
import json
import os
import signal
import subprocess
import sys

import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tests.conftest import Verbs
from tests.core.pool.patience import ending

FORCE = ("run", "--repeats", "1", "--sensor", "icub", "--task", "force")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("run"), here=True)
    done = verbs(*FORCE, "--format", "json")
    return verbs, json.loads(done.stdout), done


def test_results_on_stdout_progress_on_stderr(ran):
    _, rows, done = ran
    assert {row["estimator"] for row in rows} == {"lasso", "ols", "boosting", "mean", "time-index"}
    assert "recording" in done.stderr
    assert "evaluating" in done.stderr


def test_a_row_says_what_section_six_promises(ran):
    _, rows, _ = ran
    keys = {
        *("cell", "sensor", "task", "rig", "protocol", "estimator", "repeats", "status", "reason", "metric", "score"),
        *("ci_low", "ci_high", "baseline", "n_recordings", "n_test", "sim_s", "fit_s"),
        *("latency_ms_p50", "latency_ms_p95", "peak_rss_mb"),
    }
    for row in rows:
        assert keys <= set(row)
        assert row["status"] == "done"
        assert (row["n_replicates"], row["ci_low"]) == (1, None), "one replicate carries no interval"
        assert row["simulated"]
        assert row["dagger"]
        assert row["latency_ms_p50"] > 0
        assert row["sim_s"] > 0
    (lasso,) = [row for row in rows if row["estimator"] == "lasso" and not row["params"]]
    assert lasso["published"] == 0.7659
    assert {"placement_scatter_mm", "drift_scale", "noise_scale"} <= set(lasso["assumptions"])
    # Where the cap meets the skin stands beside how far it misses that place.
    assert (lasso["assumptions"]["contact_x_mm"], lasso["assumptions"]["contact_s_mm"]) == (-0.3, 0.0)


def test_the_time_index_sees_the_label_noise_and_lasso_lies_above_it(ran):
    _, rows, _ = ran
    score = {row["estimator"]: row["score"] for row in rows}
    # 4400 test samples: the standard error of an RMSE is 1/sqrt(2 n) = 1.1 %; three of them.
    assert score["time-index"] == pytest.approx(0.6875, rel=0.033)
    assert score["time-index"] < score["lasso"] < score["mean"]


def test_the_files_of_a_run(ran):
    verbs, rows, _ = ran
    out = verbs.folder / "tactbench-results"
    assert json.loads((out / "leaderboard.json").read_text()) == rows
    with (out / "leaderboard.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert "|  | icub | time-index |" in (out / "leaderboard.md").read_text()
    store = Store(out)
    assert {store.provenance(row["made_by"])["distributions"]["numpy"] for row in store.rows()}
    assert not list(out.rglob("*.partial"))


def test_a_second_run_computes_nothing_and_says_the_same(ran):
    verbs, rows, _ = ran
    again = verbs(*FORCE, "--format", "json")
    assert "6 of 6 answers were found finished, 0 computed now" in again.stderr
    assert json.loads(again.stdout) == rows


def test_the_same_seed_gives_the_same_scores_serially_and_with_two_jobs(ran):
    verbs, rows, _ = ran
    Verbs(verbs.folder)(*FORCE, "--jobs", "2", "--out", "parallel")
    serial, parallel = (
        [{name: row[name] for name in SEED_DECIDES} for row in Store(verbs.folder / out).rows()]
        for out in ("tactbench-results", "parallel")
    )
    assert parallel == serial
    other = json.loads(verbs(*FORCE, "--estimator", "ols", "--seed", "2", "--out", "other", "--format", "json").stdout)
    before = {row["estimator"]: row["score"] for row in rows if row["estimator"] in ("ols", "mean", "time-index")}
    after = {row["estimator"]: row["score"] for row in other}
    assert after.keys() == before.keys()
    assert all(after[name] != before[name] for name in before)


def test_recordings_of_a_run_can_be_replayed_with_the_same_scores(ran):
    verbs, rows, _ = ran
    replayed = json.loads(
        verbs("run", "--rig", "replay", "--recordings", "tactbench-results/recordings", "--task", "force",
              "--protocol", "karl2016", "--format", "json", "--out", "replayed").stdout
    )  # fmt: skip
    assert [row["score"] for row in replayed] == [row["score"] for row in rows]
    assert all(row["simulated"] for row in replayed)


def test_a_cell_that_fails_is_a_row_and_stops_nobody(ran):
    verbs, _, _ = ran
    out = verbs.folder / "tactbench-results"
    for path in (out / "recordings" / "icub").glob("flat-test-*.h5"):
        damaged = path.read_bytes()[:2000]
        path.unlink()
        path.write_bytes(damaged)
    asked = ("--sensor", "icub", "--sensor", "ideal", "--task", "force", "--estimator", "ols")
    done = Verbs(verbs.folder)("run", "--repeats", "1", *asked, "--format", "json", code=1)
    rows = json.loads(done.stdout)
    assert {row["status"] for row in rows if row["sensor"] == "icub"} == {"failed"}
    assert {row["status"] for row in rows if row["sensor"] == "ideal"} == {"done"}
    assert all("flat-test" in row["reason"] for row in rows if row["sensor"] == "icub")


def test_a_strangers_sensor_runs(shell):
    asked = ("--sensor", "acme-pad", "--task", "force", "--estimator", "lasso", "--format", "json")
    done = shell("run", "--repeats", "1", *asked, plugins=("good", "broken"))
    rows = json.loads(done.stdout)
    assert {row["status"] for row in rows} == {"done"}
    (lasso,) = [row for row in rows if row["estimator"] == "lasso" and not row["params"]]
    assert lasso["score"] < lasso["baseline"]


RUN = [sys.executable, "-m", "tactbench", *FORCE, "--jobs", "1", "--estimator", "ols", "--estimator", "forest"]


def interrupted(folder, step):
    """Interrupt a run once `step` steps are done and the next is under way; return its code and its streams."""
    folder.mkdir()
    env = {**os.environ, "PYTHONPATH": ""}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with ending(RUN, cwd=folder, env=env, **pipes) as running:
        for line in running.stderr:
            if line.startswith(f"recording and evaluating, timed: {step}/"):
                break
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=60)
    return running.returncode, out, err


@pytest.mark.parametrize("step", [1, 5], ids=["recording", "evaluating"])
def test_ctrl_c_leaves_nothing_half_written_and_the_next_run_continues(tmp_path, step):
    for attempt in range(3):  # Python drops an interrupt that comes while it is inside a destructor: rare
        folder = tmp_path / str(attempt)
        code, out, err = interrupted(folder, step)
        if code == 130:
            break
    assert code == 130, err
    assert "goes on from there" in err
    assert "Traceback" not in err
    assert out == ""
    results = folder / "tactbench-results"
    assert not list(results.rglob("*.partial"))
    finished = {path.name: path.read_bytes() for path in results.rglob("*.h5")}
    assert finished
    Verbs(folder, here=True)(*FORCE, "--estimator", "ols")
    for name, content in finished.items():
        (path,) = results.rglob(name)
        assert path.read_bytes() == content, "what was finished is reused, not made again"


def test_a_row_over_several_places_states_all_of_them(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    asked = ("--sensor", "icub", "--task", "force", "--split", "placement", "--protocol", "deployable")
    asked += ("--set", "rung=closed-form")  # the cheapest
    rows = json.loads(verbs("run", "--repeats", "1", *asked, "--estimator", "ols", "--format", "json").stdout)
    (row,) = [row for row in rows if row["estimator"] == "ols"]
    # Nominal at (-0.3, 0), and 1.5 mm either way along and across.
    assert row["assumptions"]["contact_x_mm"] == "-1.8 to 1.2"
    assert row["assumptions"]["contact_s_mm"] == "-1.5 to 1.5"
    assert row["assumptions"]["placement_scatter_mm"] == 0.1
