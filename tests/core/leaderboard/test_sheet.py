"""Rows laid out by key."""

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.sheet import MOST_OTHERS, Sheet, columns_of, marks_of
from tactbench.core.spec.row import FORMAT

from .rows import row

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 2) | st.sampled_from([0.0, -0.0, 1.0]) | st.sampled_from(["", "a"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from("ab"), inner, max_size=2),
    max_leaves=4,
)  # fmt: skip
ROWS = st.lists(st.dictionaries(st.sampled_from("abcd"), VALUES, max_size=4), max_size=6)


@given(ROWS)
def test_a_column_has_what_each_row_has_under_its_key(rows):
    columns, everywhere = columns_of(rows)
    assert list(columns) == sorted(set().union(*rows))
    assert everywhere == {key for key in columns if all(key in one for one in rows)}
    for key, values in columns.items():
        assert list(values) == [one.get(key) for one in rows]


@given(ROWS.filter(len), st.data())
def test_rows_taken_out_bring_their_columns(rows, data):
    places = data.draw(st.lists(st.integers(0, len(rows) - 1), max_size=8))
    taken = Sheet(rows).taken(places)
    assert list(taken.rows) == [rows[place] for place in places]
    for key in taken:
        assert list(taken[key]) == [rows[place].get(key) for place in places]


@given(st.lists(VALUES, max_size=8), st.data())
def test_values_of_one_mark_are_equal_to_the_type(values, data):
    values = [*values, *data.draw(st.lists(st.sampled_from(values), max_size=8))] if values else values
    marks = marks_of(values)
    for one, value in zip(marks, values, strict=True):
        for other, another in zip(marks, values, strict=True):
            assert (one == other) == (repr(value) == repr(another))


def test_values_that_are_no_plain_data_are_told_apart():
    one, other = object(), object()
    assert len(set(marks_of([one, other, one, other, one, other]))) == 2


def test_names_are_those_of_each_row():
    rows = [row("a"), row("b", simulated=False), row("a", params={"alpha": 2}), row("a", simulated=False)]
    assert Sheet(rows).sensors == ["a SIM", "b", "a SIM", "a"]
    assert Sheet(rows).answers == ["lasso", "lasso", "lasso (alpha=2)", "lasso"]


def test_a_strangers_rows_with_keys_of_their_own_do_not_fill_the_memory():
    rows = [{**row(f"s{n}"), f"own {n}": n} for n in range(3 * MOST_OTHERS)]
    columns, _ = columns_of(rows)
    assert len(columns) <= len(FORMAT) + MOST_OTHERS
    assert set(row()) <= set(columns)
