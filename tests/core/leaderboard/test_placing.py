"""Places and their intervals."""

import numpy as np
import pytest

from tactbench.core.leaderboard.blocks import places
from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.rank import Rank
from tactbench.core.statistics.ranking import ranks

from .rows import resampled, row


@pytest.fixture
def rows():
    rng = np.random.default_rng(7)
    return [resampled("a", 0.0, rng), resampled("b", 0.02, rng), resampled("c", 2.0, rng)]


def test_without_replicates_places_are_by_score_and_the_table_says_so():
    rows = [row("a"), row("b"), row("c", score=0.9)]
    found, why = places(rows)
    assert list(found.values()) == [
        Rank(1, None, None, True),
        Rank(1, None, None, True),
        Rank(3, None, None, False),
    ]
    assert why
    table = build_table(rows)
    assert [line.texts["place"] for line in table.blocks[0].lines] == ["1=", "1=", "3"]
    assert any("by score alone" in said for said in table.blocks[0].verdict)


def test_with_replicates_ties_share_a_place_and_every_place_has_an_interval(rows):
    table = build_table(rows)
    assert not any("by score alone" in said for said in table.blocks[0].verdict)
    lines = table.blocks[0].lines
    told = {one: (rank.place, rank.low, rank.high, rank.tied) for one, rank in ranks(rows).items()}
    for line in lines:
        place, low, high, tied = told[line.row["cell"]]
        assert line.cells[0] == f"{place}{'=' if tied else ''}"
        assert (line.placing.low, line.placing.high) == (low, high)
    assert [line.cells[0] for line in lines] == ["1=", "1=", "3"]
    assert any("= not all of these can be told apart" in note for note in table.notes)
