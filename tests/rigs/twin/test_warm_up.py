"""The warm-up can be read off rest levels, as it was read off those of the one real BioTac that was watched."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SEEDS = range(1, 17)


@pytest.fixture
def time_constants(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    from nuisance_changes import time_constants

    return time_constants


def _recovered(found):
    return sum(450.0 <= tau <= 650.0 for tau in found)


def test_the_time_constant_is_recovered_from_eleven_logs(time_constants):
    # 500 s in the spec, 552 +- 48 s measured: 14 of 16 seeds, each log with offsets of its own.
    assert _recovered(time_constants(SEEDS)) >= 14


def test_offsets_of_hard_handling_hide_it(time_constants):
    # Shared offsets of 15 counts against 71 counts of warm-up in 12.3 minutes: the real levels lay within 1.3 counts of
    # the fitted curve, which such offsets leave to chance.
    assert _recovered(time_constants(SEEDS, "hard-handled")) < 8
