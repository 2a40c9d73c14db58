"""The format of rows, and those who go by it."""

from tactbench.core.leaderboard.records import JSON_KEYS, OF_REPLICATES
from tactbench.core.spec.row import FORMAT
from tests.core.leaderboard.rows import row


def test_every_key_of_a_row_and_of_a_table_has_its_format():
    assert set(row()) | set(JSON_KEYS) | set(OF_REPLICATES) == set(FORMAT)


def test_a_row_as_it_is_laid_out_keeps_to_it():
    for key, value in row().items():
        assert type(value) in FORMAT[key], key
