import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.board.pack import Pack
from tactbench.core.leaderboard.board.words import write_words, written

from .reading import opened, texts

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**49), 2**49) | st.floats(-1e9, 1e9) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=10,
)  # fmt: skip


def read(values, longest=65_536):
    pack = Pack()
    column = write_words(pack, values, longest)
    return None if column is None else texts(opened(pack.blobs), column)


@given(st.lists(PLAIN, max_size=10))
def test_what_json_can_say_is_read_back(values):
    back = read(values)
    if back is None:
        assert all(one in (None, "", [], {}) for one in values)
    else:
        assert json.dumps(back) == json.dumps(values)  # not ==: 1 and True are equal


def test_equal_values_are_written_once_and_shared_ones_not_even_looked_at():
    shared = [{"effect": "creep", "reason": "long"}]
    pack = Pack()
    few = write_words(pack, [shared] * 50)
    size = pack.size
    assert write_words(pack, [[{"effect": "creep", "reason": "long"}] for _ in range(50)]) == few
    assert pack.size == size


class Grim:
    def __str__(self):
        raise RuntimeError("no")


LOOP: list = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (float("nan"), "nan"), (float("-inf"), "-inf"), ([1, float("inf")], [1, "inf"]), (2**60, str(2**60)),
        (10**5000, "a whole number of more than 100 digits"), ({1: "a"}, {"1": "a"}), (b"ab", "b'ab'"),
        ({3, }, "{3}"), (Grim(), "[a Grim that cannot be shown: RuntimeError]"), ((1, 2), [1, 2]),
    ],
    ids=["nan", "inf", "in-a-list", "large", "huge", "key", "bytes", "set", "grim", "tuple"],
)  # fmt: skip
def test_what_json_has_no_word_for_becomes_text(value, expected):
    assert json.loads(written(value)) == expected


def test_what_has_no_end_is_cut():
    assert "too deep" in written(LOOP)
    assert written("x" * 100 + "end", 50).endswith('end"')
    assert "[cut: the last 50 of 103 characters]" in written("x" * 100 + "end", 50)
    assert len(written({str(n): "y" * 50 for n in range(10_000)}, 1_000)) < 10_000
    assert "more]" in written(list(range(10_000)), 1_000)


def test_nothing_in_the_data_can_end_a_script():
    pack = Pack()
    write_words(pack, ["</script>", "<!--", "\u2028", "\ud800", "<script>alert(1)</script>"])
    assert all(not set(blob) & set("<>&\u2028'\"") for blob in pack.blobs)
