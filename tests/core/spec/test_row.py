"""The format of rows, and those who go by it."""

import pytest
from pydantic import ValidationError

from tactbench.core.leaderboard.formats import JSON_KEYS, OF_REPLICATES
from tactbench.core.spec.row import FORMAT, RowModel
from tests.core.leaderboard.rows import row


def test_every_key_of_a_row_and_of_a_table_has_its_format():
    assert set(row()) | set(JSON_KEYS) | set(OF_REPLICATES) == set(FORMAT)
    assert [key for key, value in row().items() if type(value) not in FORMAT[key]] == []


def test_a_row_holds_no_number_that_is_none():
    assert RowModel(cell="a", status="done", score=0.5).score == 0.5
    for score in (float("nan"), float("inf"), "0.5"):
        with pytest.raises(ValidationError):
            RowModel(cell="a", status="done", score=score)
