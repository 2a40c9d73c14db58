"""The format of rows, and those who go by it."""

import pytest

from tactbench.core.leaderboard.records import JSON_KEYS, OF_REPLICATES
from tactbench.core.spec.row import FORMAT, in_words
from tests.core.leaderboard.rows import row


def test_every_key_of_a_row_and_of_a_table_has_its_format():
    assert set(row()) | set(JSON_KEYS) | set(OF_REPLICATES) == set(FORMAT)


def test_a_row_as_it_is_laid_out_keeps_to_it():
    for key, value in row().items():
        assert type(value) in FORMAT[key].types, key


@pytest.mark.parametrize(
    ("types", "words"),
    [({str}, "text"), ({float, int, type(None)}, "a number or nothing"), ({int}, "a whole number")],
)
def test_types_are_told_in_words(types, words):
    assert in_words(types) == words
