"""What ``import tactbench`` gives: the same numbers as the command line and as scikit-learn, by fewer words."""

import subprocess
import sys

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import tactbench
from tactbench.core.errors import FormatError, MissingRecordingError, UnknownNameError, UsageError
from tests.conftest import Verbs
from tests.core.evaluation.made import ramp, record, sessions
from tests.here import make_here

HEAVY = ("h5py", "sklearn", "scipy", "numpy", "pydantic", "pandas")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Five sessions of presses."""
    folder = tmp_path_factory.mktemp("presses")
    sessions(folder, "abcde", n=120)
    return folder


@pytest.fixture
def here(monkeypatch, tmp_path):
    """Runs carry out cells in this process, in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    make_here(monkeypatch)


def scaled(model):
    """A model after what the protocol does to the training rows of each fold."""
    return make_pipeline(StandardScaler(), model)


def test_importing_it_imports_no_library_of_numbers_or_files():
    code = f"import sys, tactbench; dir(tactbench); print([one for one in {HEAVY} if one in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert all(callable(getattr(tactbench, name)) for name in tactbench.__all__)
    with pytest.raises(AttributeError, match="nothing"):
        _ = tactbench.nothing


# Recordings


def test_recordings_are_found_by_file_folder_and_glob(folder):
    everything = [one.path for one in tactbench.open_recordings(folder)]
    assert everything == sorted(folder.glob("*.h5"))
    assert [one.path for one in tactbench.open_recordings(str(folder / "*.h5"))] == everything
    some = tactbench.open_recordings(
        [folder / "b.h5", str(folder / "[ab].h5"), *tactbench.open_recordings(folder / "c.h5")]
    )
    assert [one.path.stem for one in some] == ["b", "a", "c"]
    with pytest.raises(MissingRecordingError, match=r"nowhere\.h5"):
        tactbench.open_recordings(folder / "nowhere.h5")


def test_a_recording_is_its_arrays_with_their_clock(tmp_path):
    X, force = ramp(1, n=50)
    path = record(tmp_path / "a.h5", X, force, t_ns=np.arange(50) * 10_000_000 + 5_000_000_000, session="s")
    (one,) = tactbench.open_recordings(path)
    taxels = one.streams["taxels"]
    assert (one.sensor.name, one.meta.session) == ("made", "s")
    assert list(one.streams) == ["taxels", "force_torque"]
    assert list(one.reference) == ["force_torque"]
    np.testing.assert_array_equal(taxels.data, X)
    np.testing.assert_allclose(taxels.time_s, np.arange(50) * 0.01, rtol=1e-12)  # to the last digits of float64
    assert [channel.name for channel in taxels.channels] == ["t0", "t1", "t2"]
    untimed = tactbench.open_recordings(record(tmp_path / "b.h5", X, t_ns=None))[0]
    assert untimed.streams["taxels"].time_s is None


def test_frames_have_channels_as_columns_and_no_number_where_there_is_no_sample(tmp_path):
    pytest.importorskip("pandas")
    X, force = ramp(1, n=5)
    force[2] = np.nan
    (one,) = tactbench.open_recordings(record(tmp_path / "a.h5", X, force, annotations={"press": np.arange(5)}))
    frame = one.to_dataframe()
    assert list(frame.columns) == ["t0", "t1", "t2", "press"]
    assert frame.index.name == "time_s"
    assert one.to_dataframe("force_torque")["fz"].isna().tolist() == [False, False, True, False, False]
    with pytest.raises(FormatError, match=r"no stream 'taxel'.*taxels, force_torque"):
        one.to_dataframe("taxel")


def test_xarray_opens_the_file_with_coordinates(tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    X, _ = ramp(1, n=60)
    notes = {"press": np.arange(60) // 10, "kind": np.repeat(["stable", "slipped"], 30)}
    path = record(tmp_path / "a.h5", X, annotations=notes)
    (one,) = tactbench.open_recordings(path)
    for found in (xarray.open_dataset(path, group="streams/taxels", engine="h5netcdf"), one.to_xarray()):
        assert found["data"].dims == ("t_ns", "channel")
        np.testing.assert_array_equal(found["data"].sel(channel="t1"), X[:, 1])
        assert found["t_ns"].values[1] == 10_000_000
    np.testing.assert_array_equal(one.to_xarray()["press"], notes["press"])
    assert one.to_xarray()["time_s"].dims == ("t_ns",)
    assert one.to_xarray()["time_s"].values[1] == pytest.approx(0.01, rel=1e-12)  # rounding of 1e-9


# Scores


def test_scikit_learns_own_loop_gives_the_score_of_each_fold(folder):
    model = scaled(Ridge())
    data = tactbench.load_task("force", folder)
    found = tactbench.evaluate(model, "force", folder)
    ours = cross_val_score(model, data.X, data.y, cv=data.folds, scoring="neg_root_mean_squared_error")
    # `evaluate` scales before the pipeline does: scaled twice, a number differs in its last digits.
    np.testing.assert_allclose(list(found.fold_scores.values()), -ours, rtol=1e-9)
    assert data.feature_names == ("t0", "t1", "t2")
    assert data.X.shape == (600, 3)
    assert len(set(data.groups)) == len(data.folds) == 5
    errors = found.predictions["y_true"] - found.predictions["y_pred"]
    assert found.score == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-12)  # rounding of the sum
    assert not hasattr(model[-1], "coef_"), "the object stays as it was given"


def test_a_result_has_what_a_row_has_and_shows_it(folder):
    found = tactbench.evaluate(scaled(Ridge()), "force", folder)
    low, high = found.interval
    assert low < found.score < high < found.trivial["mean"]
    assert "5 sessions" in found.row["ci_method"]
    assert found.recording_scores.keys() == set("abcde")
    assert found.recording_scores == pytest.approx(found.fold_scores)
    assert len(found.predictions) == 600
    assert {row["estimator"] for row in found} == {"StandardScaler+Ridge", "mean", "time-index"}
    assert found.row["answer_delay_ms"] > 0
    assert all("StandardScaler+Ridge" in shown for shown in (repr(found), found._repr_html_()))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda folder: tactbench.evaluate("force", Ridge(), folder), "task=Ridge"),
        (lambda folder: tactbench.run(tasc="force"), "'task'"),
        (lambda folder: tactbench.run(task="force", repeats=0), "^repeats: "),
        (lambda folder: tactbench.run(task="force", estimator={"ridge": Ridge()}), "same name"),
        (lambda folder: tactbench.run(task="force", recordings=tactbench.open_recordings(folder)[1:]), "of one folder"),
        (lambda folder: tactbench.results(folder / "nothing"), "no results"),
    ],
)
def test_mistakes_are_named_before_anything_is_computed(folder, call, said):
    with pytest.raises(UsageError, match=said):
        call(folder)


# Runs and results


def test_a_run_is_that_of_the_verb_and_leaves_the_same_folder(folder, here, tmp_path):
    found = tactbench.run(task="force", recordings=folder, estimator=["ridge", "ols"], split="session", out="mine")
    table = Verbs(tmp_path, here=True)("leaderboard", "mine").stdout
    assert repr(found).split()[:8] == table.split()[:8]  # times may make columns wider, and the title with them
    assert {row["estimator"] for row in found} == {"ridge", "ols", "mean", "time-index"}
    again = tactbench.results("mine")
    assert list(again) == list(found)
    assert (tmp_path / "mine" / "leaderboard.csv").is_file()
    assert len(again.best()) == 1
    assert list(again[1:3]) == [again[1], again[2]]
    (compared,) = again.compare("ridge", "ols")
    assert (compared["a"], compared["b"], compared["replicates"]) == ("ridge", "ols", 5)
    with pytest.raises(UnknownNameError):
        again.compare("ridge", "lasso")


def test_what_draws_at_random_scores_the_same_by_evaluate_and_by_run(folder, here):
    (row,) = tactbench.run(task="force", recordings=folder, estimator="forest-100").best()
    assert tactbench.evaluate("forest-100", "force", folder).score == row["score"]


def test_objects_stand_in_the_table_and_not_in_the_folder(folder, here):
    models = {"mine": scaled(Ridge()), "other": scaled(Ridge(alpha=100.0)), "classes": LogisticRegression(),
              "ridge": "ridge"}  # fmt: skip
    found = tactbench.run(task="force", recordings=tactbench.open_recordings(folder), estimator=models, out="mine")
    scores = {row["estimator"]: row["score"] for row in found}
    assert scores.keys() == {*models, "mean", "time-index"}
    assert [row["estimator"] for row in found if row["status"] == "failed"] == ["classes"]
    assert "classes failed" in repr(found)
    assert scores["mine"] == tactbench.evaluate(models["mine"], "force", folder).score
    assert found.compare("mine", "other")[0]["replicates"] == 5
    assert {row["estimator"] for row in tactbench.results("mine")} == {"ridge", "mean", "time-index"}


def test_an_object_that_nothing_can_be_asked_of_is_a_row_all_the_same(folder, here):
    found = tactbench.run(task="object-identity", recordings=folder, estimator=Ridge(), out="mine")
    assert {row["estimator"] for row in found} == {"Ridge", "chance", "majority"}
    assert {row["status"] for row in found} == {"skipped"}


def test_objects_answer_every_replicate_of_a_simulation(here):
    found = tactbench.run(sensor="ideal", task="force", estimator=Ridge(), repeats=2, protocol="deployable", out="mine")
    own = next(row for row in found if row["estimator"] == "Ridge")
    assert own["simulated"]
    assert own["n_replicates"] == 2
    assert len(set(own["replicate_scores"])) == 2
