"""Rows laid out by key."""

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.column_table import MOST_OTHERS, ColumnTable
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
    table = ColumnTable(rows)
    assert list(table) == sorted(set().union(*rows))
    for key, values in table.items():
        assert list(values) == [one.get(key) for one in rows]


@given(ROWS.filter(len), st.data())
def test_rows_taken_out_bring_their_columns(rows, data):
    places = data.draw(st.lists(st.integers(0, len(rows) - 1), max_size=8))
    taken = ColumnTable(rows).taken(places)
    assert list(taken.rows) == [rows[place] for place in places]
    for key in taken:
        assert list(taken[key]) == [rows[place].get(key) for place in places]


def test_names_are_those_of_each_row():
    rows = [row("a"), row("b", simulated=False), row("a", params={"alpha": 2}), row("a", simulated=False)]
    assert ColumnTable(rows).sensors == ["a SIM", "b", "a SIM", "a"]
    assert ColumnTable(rows).answers == ["lasso", "lasso", "lasso (alpha=2)", "lasso"]


def test_a_strangers_rows_with_keys_of_their_own_do_not_fill_the_memory():
    rows = [{**row(f"s{n}"), f"own {n}": n} for n in range(3 * MOST_OTHERS)]
    columns = ColumnTable(rows)
    assert len(columns) <= len(FORMAT) + MOST_OTHERS
    assert set(row()) <= set(columns)
