"""One answer a recording: by summaries on each stream's own clock."""

import numpy as np
import pytest

from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import protocol_called
from tactbench.core.evaluation.splits import make_splits
from tactbench.core.evaluation.summaries import summarised
from tactbench.plugin import Block, ChannelSpec, StreamSpec, Summary
from tests.core.evaluation.made import evaluated, held, label_task, record, sensor_of, write

MOVES = (Summary(measure="deviation"), Summary(measure="mean-step"))


def task(**more):
    return label_task("slip", **{
        "splits": ("object", "session", "recording", "shuffled"), "answer_per": "recording", "summaries": MOVES, **more
    })  # fmt: skip


def sequences(folder, number=24, **more):
    """Recordings of which every third slips: it shakes three times as much, about an offset that tells nothing."""
    rng = np.random.default_rng(5)
    paths = []
    for place in range(number):
        shakes, label = (1.0, "stable") if place % 3 else (3.0, "slipped")
        X = rng.normal(0, shakes, (40, 2)) + rng.normal(0, 50.0, 2)
        paths.append(record(folder / f"s{place:02d}.h5", X, labels={"slip": label}, trial=str(place), **more))
    return paths


def run(asked, paths, split=None, estimator="forest", protocol="deployable", **more):
    params = {"n_estimators": 20} if estimator == "forest" else {}
    return evaluated(asked, paths, estimator, protocol, split, params=params, **more)


def test_a_recording_is_one_answer_by_what_it_did_and_not_where_it_stood(tmp_path):
    paths = sequences(tmp_path)
    result = run(task(), paths)
    assert (result.split, result.n_train) == ("recording", 4 * 24)
    # Deviations of 1 and 3 from 40 samples are known to 11 %: eight standard errors apart.
    assert result.score == 1.0
    assert result.ci_method.startswith("jackknife over 24 recordings ")


def test_splits_keep_recordings_whole(tmp_path):
    paths = sequences(tmp_path)
    data = load_dataset(task(), paths)
    for split in ("recording", "shuffled"):
        for fold in make_splits(data, split, 1):
            np.testing.assert_array_equal(fold.test, ~fold.train)
            assert all((rows == rows[0]).all() for rows in data.parted(fold.test))
    tested = [np.unique(data.recording[fold.test]) for fold in make_splits(data, "shuffled", 1)]
    assert {sum(data.tables[place].y[0] for place in fold) for fold in tested} <= {3, 4}  # 16 of 24 are stable
    assert "random" in run(task(), paths, "shuffled").stamps[0]


def test_splits_and_answers_that_cut_recordings_are_refused_with_words(tmp_path):
    halves = {name: np.repeat([1, 2], 20) for name in ("slip", "press")}
    with pytest.raises(NotApplicable, match="'in-session'"):
        run(task(), sequences(tmp_path), "in-session")
    with pytest.raises(UsageError, match="'press'"):
        run(task(), sequences(tmp_path / "b", annotations={"press": halves["press"]}), "press")
    changing = record(tmp_path / "c.h5", np.ones((40, 2)), annotations=halves)
    with pytest.raises(NotApplicable, match=r"'slip'.*'c'"):
        run(task(), [changing])


@pytest.mark.parametrize("protocol", ["karl2016", "deployable@k=3", "deployable@every=2"])
def test_summaries_are_of_all_samples(tmp_path, protocol):
    rng = np.random.default_rng(0)
    paths = [record(tmp_path / f"{role}.h5", rng.normal(size=(40, 2)), labels={"slip": "no"}, role=role, session=role)
             for role in ("train", "validation", "test")]  # fmt: skip
    with pytest.raises(NotApplicable, match=protocol):
        run(task(splits=("roles",)), paths, "roles", "logistic", protocol)


TWO = sensor_of(
    StreamSpec(name="taxels", channels=(ChannelSpec(name="t", kind="taxel"),)),
    StreamSpec(name="pac", channels=(ChannelSpec(name="p", kind="ac_pressure"),)),
)
SLOW_HZ, FAST_HZ = 50, 2000


def two_rates(folder):
    """Taxels of noise alone, and a fast stream that hums at 200 Hz where it slips; loaded after a hold of 0.5 s."""
    rng, scene = np.random.default_rng(2), held("held", 0.5, samples=100)
    slow_s, fast_s = np.arange(0, 2, 1 / SLOW_HZ), np.arange(0, 2, 1 / FAST_HZ)
    paths = []
    for place in range(12):
        hum = (place % 2) * np.sin(2 * np.pi * 200 * fast_s) + rng.normal(0, 0.1, len(fast_s)) + 30.0
        blocks = (
            Block("taxels", (slow_s * 1e9).astype(np.int64), rng.normal(20.0, 1, (len(slow_s), 1))),
            Block("pac", (fast_s * 1e9).astype(np.int64), hum[:, None]),
        )
        paths.append(write(folder / f"s{place:02d}.h5", TWO, *blocks, labels={"slip": place % 2}, scene=scene))
    return paths


FAST = task(
    features=("taxel", "ac_pressure"),
    summaries=(
        Summary(measure="band-energy", band_hz=(150.0, 300.0), start=0.5, kinds=("ac_pressure",)),
        Summary(measure="mean"),
        Summary(measure="deviation"),
    ),
)


def test_every_stream_is_summarised_on_its_own_clock(tmp_path):
    """A hum of 200 Hz sampled at every fortieth sample would stand still; its energy is half its amplitude squared."""
    data = load_dataset(FAST, two_rates(tmp_path))
    found = summarised(data, FAST, protocol_called("deployable-untared"))
    assert found.features[1:] == ("t mean", "p mean", "t deviation", "p deviation")
    energies = [table.X[0, 0] for table in found.tables]
    # The gain of the filter at 200 Hz is within 1 % of 1; noise of 0.1 puts less than 0.01 into the band.
    assert energies[1::2] == pytest.approx([0.5] * 6, abs=0.02)
    assert max(energies[::2]) < 0.01


def test_the_hold_is_tared_on_and_left_out_of_every_stream(tmp_path):
    paths = two_rates(tmp_path)
    data = load_dataset(FAST, paths)
    tared, untared = (summarised(data, FAST, protocol_called(name)) for name in ("deployable", "deployable-untared"))
    # A mean of 25 and of 1000 samples less one of 75 and of 3000: 0.23 and 0.03 at most, four times that here.
    assert all(abs(table.X[0, 1]) < 1.0 and abs(table.X[0, 2]) < 0.1 for table in tared.tables)
    assert all(table.X[0, 1] == pytest.approx(20, abs=1) for table in untared.tables)
    result = run(FAST, paths)
    assert (result.tare_s, result.score) == (pytest.approx(0.5), 1.0)
    assert result.delay_parts_ms["window"] == pytest.approx(1500, abs=1e3 / SLOW_HZ)
