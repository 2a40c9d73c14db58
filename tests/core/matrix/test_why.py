"""Which cell a person means by a name, and how two keys differ."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.matrix.keys import differences
from tactbench.core.matrix.why import meant

FOREST, FAST = "a/t/twin/p/forest", "a/t/twin/p/forest-fast"
NAMES = [f"{FOREST}/10", f"{FOREST}/2", f"{FOREST}/1", f"{FAST}/1", "b/t/twin/p/forest/1"]


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (f"{FOREST}/2", f"{FOREST}/2"),
        (FOREST, f"{FOREST}/1"),  # not forest-fast, whose name begins alike
        (FAST, f"{FAST}/1"),
        ("fast", f"{FAST}/1"),
        ("b/", "b/t/twin/p/forest/1"),
    ],
)
def test_the_name_of_a_cell_without_its_replicate_is_the_first_of_them(given, found):
    assert meant(given, NAMES) == found


def test_a_part_of_several_cells_is_refused_with_their_names():
    with pytest.raises(UsageError, match="4 cells") as refused:
        meant("a/t", NAMES)
    assert FAST in refused.value.hint
    with pytest.raises(UsageError) as many:
        meant("x", [f"x{place}/{'y' * place}" for place in range(9)])
    assert many.value.hint.endswith(", x7/yyyyyyy and 1 more.")
    with pytest.raises(UsageError, match="no cell called 'z'"):
        meant("z", NAMES)


def test_differences_are_told_name_by_name():
    before = {"a": {"b": 1, "c": "x" * 61}, "d": 1.0, "e": [1], "f": "y" * 60}
    now = {"a": {"b": 2, "c": "z"}, "d": 1, "e": [1], "g": {"k": True}, "f": ""}
    assert differences(before, now) == [
        "a: b 1 -> 2", f"a: c {'x' * 59}… -> z", "d 1.0 -> 1", f"f {'y' * 60} -> ", 'g nothing -> {"k":true}',
    ]  # fmt: skip
    assert differences({"d": 1.0, "e": 2}, {"d": 1, "e": 3}, lambda old, new: old == new) == ["e 2 -> 3"]
