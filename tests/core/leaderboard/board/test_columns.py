import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.board import (
    DEEPEST,
    MANY,
    MOST_OTHERS,
    column,
    deflated,
    keys_of,
    plain,
    plain_values,
    rounded,
)  # fmt: skip
from tactbench.core.spec.row import FORMAT
from tests.core.leaderboard.rows import row

from .reading import opened, values

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**49), 2**49) | st.floats(-1e9, 1e9) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=10,
)  # fmt: skip


@given(st.lists(PLAIN, max_size=10), st.data())
def test_what_json_can_say_is_read_back(some, data):
    some = [*some, *data.draw(st.lists(st.sampled_from(some), max_size=10))] if some else some
    back = values(opened(deflated(column(plain_values(some)))))
    assert json.dumps(back, sort_keys=True) == json.dumps(some, sort_keys=True)  # not ==: 1 and True are equal


def test_values_that_rows_share_are_written_once():
    shared = [{"effect": "creep", "reason": "long"}]
    assert column([shared] * 3 + [list(shared)]) == {"dictionary": [shared], "index": [0, 0, 0, 0]}


@given(st.lists(st.none() | st.floats(), max_size=10))
def test_numbers_are_sorted_by_what_they_are_and_those_that_are_none_have_no_place(numbers):
    column_ = opened(deflated(column([str(one) for one in numbers], numbers)))
    assert column_["sort"] == [one if one is not None and math.isfinite(one) else None for one in numbers]


def test_of_many_numbers_five_digits_are_kept():
    assert set(rounded([math.pi * 1e-3] * (MANY + 1))) == {0.0031416}


LOOP: list = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (float("nan"), "nan"), (float("-inf"), "-inf"), ([1, float("inf")], [1, "inf"]), (2**60, str(2**60)),
        ({1: "a"}, {"1": "a"}), (b"ab", "b'ab'"), ((1, 2), [1, 2]),
    ],
    ids=["nan", "inf", "in-a-list", "large", "key", "bytes", "tuple"],
)  # fmt: skip
def test_what_json_has_no_word_for_becomes_text(value, expected):
    assert plain(value) == expected


def test_what_has_no_end_is_cut():
    assert json.dumps(plain(LOOP)).count("[") == DEEPEST + 1
    assert plain("x" * 100 + "end", 50) == f"[cut: the last 50 of 103 characters] {'x' * 47}end"


def test_a_strangers_rows_with_keys_of_their_own_do_not_fill_the_page():
    rows = [{**row(f"s{n}"), f"own {n}": n} for n in range(3 * MOST_OTHERS)]
    assert len(keys_of(rows)) <= len(FORMAT) + MOST_OTHERS
    assert set(row()) <= keys_of(rows)


def test_nothing_in_the_data_can_end_a_script():
    written = deflated(column(["</script>", "<!--", "\u2028", "\ud800", "<script>alert(1)</script>"]))
    assert not set(written) & set("<>&\u2028'\"")
