"""A recording under two names, or a piece of one, on both sides of a split is stamped; alike presses are not."""

import numpy as np
import pytest

from .made import evaluated, force_task, ramp, record, sessions


def stamps(paths, split="session"):
    return evaluated(force_task(), paths, split=split).stamps


def test_sessions_of_their_own_have_no_stamp(tmp_path):
    paths = sessions(tmp_path)
    assert stamps(paths) == ()
    assert stamps(paths, "in-session") == ()


@pytest.mark.parametrize("split", ["session", "roles"])
def test_one_recording_under_two_sessions_or_roles(tmp_path, split):
    roles = ("train", "train", "test") if split == "roles" else (None,) * 3
    seeds = (0, 1, 0)
    paths = [record(tmp_path / f"{n}.h5", *ramp(seeds[n], n=200), session=str(n), role=roles[n]) for n in range(3)]
    (stamp,) = stamps(paths, split)
    assert stamp.startswith("leaks: 100% of the test rows of a fold are equal to training rows")
    assert "'2' repeats '0'" in stamp or "'0' repeats '2'" in stamp


def test_a_piece_of_a_training_recording_at_another_time(tmp_path):
    one, other = ramp(0, n=200), ramp(1, n=200)
    mixed = [np.concatenate([theirs[:150], ours[100:150]]) for ours, theirs in zip(one, other, strict=True)]
    paths = [record(tmp_path / "a.h5", *one, session="1"), record(tmp_path / "b.h5", *mixed, session="2")]
    assert stamps(paths)[0].startswith("leaks: 25%")


def test_a_sensor_at_rest_repeats_itself_and_is_no_leak(tmp_path):
    paths = []
    for n in range(2):
        X, force = ramp(n, n=400)
        X[:200], force[:200] = 7.0, 0.0
        paths.append(record(tmp_path / f"{n}.h5", X, force, session=str(n)))
    assert stamps(paths) == ()


@pytest.mark.parametrize(("noise", "stamped"), [(0.0, True), (1e-3, False)])
def test_a_channel_that_is_the_target_but_for_scale_and_offset(tmp_path, noise, stamped):
    paths = []
    for n in range(2):
        X, force = ramp(n, n=200)
        X[:, 1] = 3.0 - 40.0 * (force + noise * np.random.default_rng(n).standard_normal(200))
        paths.append(record(tmp_path / f"{n}.h5", X, force, session=str(n)))
    assert any("is the target but for scale and offset" in stamp for stamp in stamps(paths)) == stamped
