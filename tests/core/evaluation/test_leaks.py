"""A recording under two names, or a piece of one, on both sides of a split is stamped; alike presses are not."""

import numpy as np
import pytest

from .made import evaluated, force_task, ramp, record, sessions


def stamps(folder, make, split="session", roles=(None, None)):
    """Return the stamps of recordings in sessions of their own; `make` gives the taxels and the force of each."""
    paths = [record(folder / f"{n}.h5", *make(n), session=str(n), role=role) for n, role in enumerate(roles)]
    return evaluated(force_task(), paths, split=split).stamps


def test_a_cut_in_time_has_no_stamp(tmp_path):
    assert evaluated(force_task(), sessions(tmp_path), split="in-session").stamps == ()


@pytest.mark.parametrize(("split", "roles"), [("session", (None,) * 3), ("roles", ("train", "train", "test"))])
def test_one_recording_under_two_sessions_or_roles(tmp_path, split, roles):
    (stamp,) = stamps(tmp_path, lambda n: ramp(n % 2, n=200), split, roles)
    assert stamp.startswith("leaks: 100% of the test rows of a fold are equal to training rows")
    assert "'2' repeats '0'" in stamp or "'0' repeats '2'" in stamp


def test_a_piece_of_a_training_recording_at_another_time(tmp_path):
    one, other = ramp(0, n=200), ramp(1, n=200)
    mixed = [np.concatenate([theirs[:150], ours[100:150]]) for ours, theirs in zip(one, other, strict=True)]
    assert stamps(tmp_path, (one, mixed).__getitem__)[0].startswith("leaks: 25%")


def test_a_sensor_at_rest_repeats_itself_and_is_no_leak(tmp_path):
    def resting(n):
        X, force = ramp(n, n=400)
        X[:200], force[:200] = 7.0, 0.0
        return X, force

    assert stamps(tmp_path, resting) == ()


@pytest.mark.parametrize(("noise", "stamped"), [(0.0, True), (1e-3, False)])
def test_a_channel_that_is_the_target_but_for_scale_and_offset(tmp_path, noise, stamped):
    def copied(n):
        X, force = ramp(n, n=200)
        X[:, 1] = 3.0 - 40.0 * (force + noise * np.random.default_rng(n).standard_normal(200))
        return X, force

    assert any("is the target but for scale and offset" in stamp for stamp in stamps(tmp_path, copied)) == stamped
