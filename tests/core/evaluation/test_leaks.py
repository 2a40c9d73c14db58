"""A recording under two names, or a piece of one, on both sides of a split is stamped; alike presses are not."""

import numpy as np
import pytest

from tactbench.core.recording.health import is_copy

from .made import evaluated, force_task, label_task, ramp, record, sessions


def stamps(folder, make, split="session", roles=(None, None)):
    """Return the stamps of recordings in sessions of their own; `make` gives the taxels and the force of each."""
    paths = [record(folder / f"{n}.h5", *make(n), session=str(n), role=role) for n, role in enumerate(roles)]
    return evaluated(force_task(), paths, split=split).stamps


def test_a_cut_in_time_has_no_stamp(tmp_path):
    assert evaluated(force_task(), sessions(tmp_path), split="in-session").stamps == []


@pytest.mark.parametrize(("split", "roles"), [("session", (None,) * 3), ("roles", ("train", "train", "test"))])
def test_one_recording_under_two_sessions_or_roles(tmp_path, split, roles):
    (stamp,) = stamps(tmp_path, lambda n: ramp(n % 2, n=200), split, roles)
    assert stamp.startswith("leaks: 100%")
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

    assert stamps(tmp_path, resting) == []


def presses(make, n=400):
    """Rows that stand each for itself, in eight places of which some are tested; `make` gives the readings."""
    rng = np.random.default_rng(1)
    force, place = rng.uniform(0, 5, n), rng.integers(0, 8, n)
    return make(force, rng), force, place.astype(str)


@pytest.mark.parametrize(("repeated", "says"), [(0, ""), (2, ""), (100, "leaks: 41%"), (400, "leaks: 96%")])
def test_single_rows_of_one_place_that_stand_in_another_one_again(tmp_path, repeated, says):
    X, force, place = presses(lambda force, rng: force[:, None] * [1, 2, 3] + rng.standard_normal((len(force), 3)))
    again = np.random.default_rng(2).choice(len(X), repeated, replace=False)
    X, force = np.concatenate([X, X[again]]), np.concatenate([force, force[again]])
    place = np.concatenate([place, np.roll(place[again], 1)])
    path = record(tmp_path / "a.h5", X, force, t_ns=None, annotations={"place": place})
    found = evaluated(force_task(splits=("place",)), [path]).stamps
    assert [stamp[: len(says)] for stamp in found] == [says] * bool(says)


def test_recordings_of_one_row_each_that_are_there_twice(tmp_path):
    X, force = ramp(1, n=10)
    rows = [record(tmp_path / f"{n}.h5", X[[n % 10]], force[[n % 10]], session=str(n // 5)) for n in range(20)]
    assert evaluated(force_task(), rows, split="session").stamps[0].startswith("leaks: ")
    assert evaluated(force_task(), rows[:10], split="session").stamps == []


COARSE = {
    "one switch": lambda force, rng: force[:, None] > 2,
    "four switches": lambda force, rng: force[:, None] > [1, 2, 3, 4],
    "five bits": lambda force, rng: np.round(6 * force[:, None] + rng.standard_normal((len(force), 1))),
    "three of five bits": lambda force, rng: np.round(6 * force[:, None] + rng.standard_normal((len(force), 3))),
    "at rest": lambda force, rng: np.where(force < 3, 0, force)[:, None] * rng.uniform(1, 2, (len(force), 4)),
    "at rest, with its last bit": lambda force, rng: (
        np.round(np.maximum(force - 4, 0)[:, None] * 1000 * [1, 2, 3, 4]) + rng.integers(0, 2, (len(force), 4))
    ),
}


@pytest.mark.parametrize("name", COARSE)
def test_readings_that_are_equal_by_chance_are_no_leak(tmp_path, name):
    X, force, place = presses(COARSE[name])
    path = record(tmp_path / "a.h5", X, t_ns=None, annotations={"place": place, "kind": np.where(force > 2, "a", "b")})
    assert evaluated(label_task(splits=("place",)), [path], "majority").stamps == []


GIVEN_AWAY = {
    "scaled": lambda force, rng: 3.0 - 40.0 * force,
    "scaled and rounded": lambda force, rng: np.round(3.0 - 400.0 * force),
    "squared": lambda force, rng: force**2,
    "a table of it": lambda force, rng: np.exp(force).round(3),
    "three rows late": lambda force, rng: np.concatenate([np.zeros(3), force[:-3] ** 3]),
    "five rows early": lambda force, rng: np.concatenate([force[5:], np.zeros(5)]),
}
HONEST = {
    "noise": lambda force, rng: force + 1e-3 * rng.standard_normal(len(force)),
    "noise, squared": lambda force, rng: (force + 1e-3 * rng.standard_normal(len(force))) ** 2,
    "a switch": lambda force, rng: force > 2.0,
    "three bits": lambda force, rng: np.round(force),
    "lags": lambda force, rng: np.convolve(force, np.ones(20) / 20)[: len(force)],
    "nothing": lambda force, rng: np.zeros(len(force)),
}


@pytest.mark.parametrize("name", [*GIVEN_AWAY, *HONEST])
def test_a_channel_that_is_a_monotone_function_of_the_target(tmp_path, name):
    def made(n):
        X, force = ramp(n, n=200, label_noise=0.1)
        X[:, 1] = (GIVEN_AWAY | HONEST)[name](force, np.random.default_rng(n))
        return X, force

    found = [stamp for stamp in stamps(tmp_path, made) if "t1 is" in stamp]
    assert bool(found) == (name in GIVEN_AWAY)


def test_a_square_gives_the_size_of_a_signed_target_away(tmp_path):
    def made(n):
        X, force = ramp(n, n=200, label_noise=0.1)
        signed = (force - 2.5) / 10  # within -1 to 1
        X[:, 1] = signed**2
        return X, signed

    assert any("t1 is" in stamp for stamp in stamps(tmp_path, made))


def test_few_rows_and_rows_of_other_recordings_are_no_evidence_of_a_copy():
    force = np.random.default_rng(1).uniform(0, 5, 300)
    assert is_copy(force**3, force)
    assert not is_copy(force[:150] ** 3, force[:150])
    assert is_copy(np.roll(force, 1), force)
    assert not is_copy(np.roll(force, 1), force, np.arange(300))
