"""Places and their intervals."""

import numpy as np
import pytest

from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.ranking import ranks

from .rows import resampled


@pytest.fixture
def rows():
    rng = np.random.default_rng(7)
    return [resampled("a", 0.0, rng), resampled("b", 0.02, rng), resampled("c", 2.0, rng)]


def test_with_replicates_ties_share_a_place_and_every_place_has_an_interval(rows):
    table = build_table(rows)
    assert not any("by score alone" in said for said in table.blocks[0].verdict)
    lines = table.blocks[0].lines
    told = {one: (rank.place, rank.low, rank.high, rank.tied) for one, rank in ranks(rows).items()}
    for line in lines:
        place, low, high, tied = told[line.row["cell"]]
        assert line.texts["place"] == f"{place}{'=' if tied else ''}"
        assert (line.placing.low, line.placing.high) == (low, high)
    assert [line.texts["place"] for line in lines] == ["1=", "1=", "3"]
    assert any("= not all of these can be told apart" in note for note in table.notes)
