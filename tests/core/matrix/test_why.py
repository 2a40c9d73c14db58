"""Which cell a person means by a name."""

import pytest

from tactbench.core.errors import UsageError
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
