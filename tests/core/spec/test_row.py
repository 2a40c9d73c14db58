"""The format of rows, and those who go by it."""

from tactbench.core.leaderboard.formats import JSON_KEYS, OF_REPLICATES
from tactbench.core.spec.row import FORMAT
from tests.core.leaderboard.rows import row


def test_every_key_of_a_row_and_of_a_table_has_its_format():
    assert set(row()) | set(JSON_KEYS) | set(OF_REPLICATES) == set(FORMAT)
    assert [key for key, value in row().items() if type(value) not in FORMAT[key]] == []
