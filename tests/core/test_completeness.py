"""A recording that lacks more than is allowed says so: silence, rows lost, and readings that stand still."""

import re

import numpy as np
import pytest

from tactbench.core.acquisition import Completeness
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.recording import StreamCounts
from tactbench.core.spec.rig_file import Allowed
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

TAXELS = StreamSpec(name="taxels", rate_hz=100.0, channels=tuple(ChannelSpec(name=f"t{n}", kind="taxel") for n in "12"))
FORCE = StreamSpec(name="force", rate_hz=100.0, channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
SECONDS, HZ, START_NS = 10, 100, 5_000_000_000


def facts(found, counts=None):
    """Return stream, first word and numbers of each sentence."""
    cut = (text.split(": ") for text in found.lacking(counts or {}))
    return [(name, rest.split()[0], *map(float, re.findall(r"[\d.]+", rest))) for name, rest in cut]


def lacking(taxels=None, force=None, counts=None, keep=lambda t_s: True, **allowed):
    """Return what is missing of ten seconds in blocks of a tenth, both streams moving unless given otherwise."""
    t_s = np.arange(SECONDS * HZ) / HZ
    noise = np.random.default_rng(1).normal(size=(len(t_s), 3))
    sensed = noise[:, :2] + 100 if taxels is None else taxels(t_s)
    forces = noise[:, 2:] * 0.01 + t_s[:, None] if force is None else force(t_s)
    found = Completeness(Allowed(**allowed), (TAXELS,), (FORCE,))
    for rows in np.arange(len(t_s)).reshape(-1, 10):
        found.add(Block("taxels", START_NS + (1e9 * t_s[rows]).astype(np.int64), sensed[rows]))
        rows = rows[[keep(at) for at in t_s[rows]]]
        found.add(Block("force", START_NS + (1e9 * t_s[rows]).astype(np.int64), forces[rows]))
    return facts(found, counts)


def test_a_whole_recording_lacks_nothing():
    assert lacking() == []


@pytest.mark.parametrize(
    ("keep", "span"),
    [
        (lambda t_s: t_s < 3.0, (7, 2.99)),  # it ended
        (lambda t_s: not 3.0 <= t_s < 6.0, (3.01, 2.99)),  # it came back
        (lambda t_s: t_s >= 3.0, (3, 0)),  # it began late
    ],
)
def test_silence_is_missing(keep, span):
    assert lacking(keep=keep) == [("force", "silent", *span)]
    assert lacking(keep=keep, silent_s=7.5) == []
    assert lacking(keep=keep, silent_s=span[0]) == []


def test_rows_without_a_number_or_marked_missing_are_silence():
    found, row = Completeness(Allowed(), (), (FORCE,)), np.arange(100)[:, None]
    quality = Quality.MISSING * (row > 50).astype(np.uint8) * (row < 75)
    found.add(Block("force", row[:, 0] * 10**8, np.where(row < 75, row, np.nan), quality))
    assert facts(found) == [("force", "silent", 4.9, 5)]


def test_a_force_that_stands_still_is_frozen_and_a_sensor_if_the_force_moves_meanwhile():
    stuck = lambda t_s: np.where(t_s < 4.0, t_s, 4.0)[:, None]  # noqa: E731
    assert lacking(force=stuck) == [("force", "frozen", 5.99, 4)]
    assert lacking(force=stuck, frozen_s=5.99) == []
    held = lambda t_s: np.minimum(t_s, 6.0)[:, None].repeat(2, 1)  # noqa: E731
    for slope, found in ((0.3, []), (0.5, [("taxels", "frozen", 3.99, 6)])):  # of 16 and 25 % of the force
        slower = lambda t_s, slope=slope: np.where(t_s < 6, t_s, 6 + slope * (t_s - 6))[:, None]  # noqa: E731
        assert lacking(taxels=held, force=slower) == found
    still = lambda t_s: np.full((len(t_s), 2), 7.0)  # noqa: E731
    assert lacking(taxels=still) == [("taxels", "frozen", 9.99, 0)]
    # A second stream of the sensor that changes shows that the sensor lives, whatever the first one does.
    sound = StreamSpec(name="sound", rate_hz=100.0, channels=(ChannelSpec(name="pac", kind="ac_pressure"),))
    found = Completeness(Allowed(), (TAXELS, sound), (FORCE,))
    for row in np.arange(20)[:, None]:
        for name, values in (("taxels", np.array([[1, row.item()]])), ("sound", 0 * row), ("force", row)):
            found.add(Block(name, row * 500_000_000, values.reshape(1, -1)))
    assert found.lacking({}) == []


def test_a_force_of_coarse_steps_may_stand_still_without_load_and_one_that_never_changes_is_frozen():
    coarse = lambda t_s: np.round(np.clip(t_s - 3.0, 0.0, 4.0), 1)[:, None]  # noqa: E731
    assert lacking(force=coarse, frozen_s=1.0) == []
    noisy = np.random.default_rng(2).normal(size=(SECONDS * HZ, 1))
    hung = lambda t_s: np.where((t_s[:, None] >= 1.0) & (t_s[:, None] < 9.9), 4.0, noisy)  # noqa: E731
    assert lacking(force=hung) == [("force", "frozen", 8.89, 1)]
    dead = lambda t_s: np.zeros((len(t_s), 1))  # noqa: E731
    assert lacking(force=dead) == [("force", "frozen", 9.99, 0)]


def test_rows_lost_are_missing_beyond_the_percentage_that_is_allowed():
    counts = {"force": StreamCounts(received=970, written=960, dropped=10, gaps=30)}
    assert lacking(counts=counts) == [("force", "40", 40, 1000)]
    assert lacking(counts=counts, lost_percent=4.0) == []
