"""Rows of a stranger's folder."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.leaderboard.checked import checked
from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.table import build_table
from tests.core.leaderboard.rendering import to_csv, to_json, to_latex, to_markdown, to_parquet

from .rows import row
from .strategies import some_rows

words = st.text(st.characters(exclude_categories=()), max_size=3)  # without a table of the codec, which takes seconds
anything = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-5, 5), st.floats(), words),
    lambda inner: st.one_of(st.lists(inner, max_size=2), st.dictionaries(words, inner, max_size=2)),
    max_leaves=4,
)


@given(some_rows())
def test_rows_of_this_version_pass(rows):
    good, wrong = checked(json.loads(json.dumps(rows)))
    assert (len(good), wrong) == (len(rows), [])


@settings(max_examples=150)
@given(some_rows(most=3), st.data())
def test_whatever_passes_can_be_shown_in_every_format(rows, data):
    for one in rows:
        for key in data.draw(st.lists(st.sampled_from(sorted(one)), max_size=3)):
            one[key] = data.draw(anything)
    good, wrong = checked(rows)
    assert len(good) + len(wrong) == len(rows)
    table = build_table(good)
    plain_text(table)
    for form in (to_json, to_csv, to_markdown, to_latex, to_parquet):
        form(good)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        (3, "no row"),
        ({"cell": "x"}, "x: its row is of another version"),
        (row() | {"score": "good"}, "its score: Input should be a valid number"),
        (row(score=None), "it is done and has no score"),
        (row(status="fine"), "its status: Input should be 'done', 'failed'"),
        (row(n_test=10**400), "n_test"),
        (row() | {"fit_s": 10**400}, "fit_s"),
        (row(counts={"a": "b"}), "counts"),
        (row(confusion=[[1, 2]]), "confusion"),
        (row() | {"score": True}, "its score: Input should be a valid number"),
    ],
)
def test_what_cannot_be_a_row_is_told(entry, says):
    good, (wrong,) = checked([entry])
    assert good == []
    assert says in wrong
