import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.board.digits import STEPS, write_digits
from tactbench.core.leaderboard.board.pack import Pack
from tactbench.core.leaderboard.numbers import duration, interval, score

from .reading import opened, texts, values

TEXTS = st.text(st.sampled_from("0123456789#.…–-− †‡smµ\u202feE\n\ud800\x00é"), max_size=24)
FINITE = st.floats(-1e6, 1e6)


def written(shown, numbers=None):
    pack = Pack()
    column = write_digits(pack, shown, numbers)
    return column, opened(pack.blobs)


@given(st.lists(TEXTS, max_size=12))
def test_any_text_is_read_back_letter_by_letter_or_refused(shown):
    column, blobs = written(shown)
    refused = not shown or any(one in text for text in shown for one in "#\n\ud800")
    assert (column is None) == refused
    if not refused:
        assert texts(blobs, column) == shown


@given(st.lists(FINITE, min_size=1, max_size=30), st.sampled_from(["N", "1"]))
def test_scores_are_sorted_by_what_they_were_rounded_from(numbers, unit):
    shown = [score(number, unit) for number in numbers]
    column, blobs = written(shown, numbers)
    assert texts(blobs, column) == shown
    for text, number, value in zip(shown, numbers, values(blobs, column), strict=True):
        last = 10.0 ** -len(text.partition(".")[2])
        # Half a step of the last digit, and what a float of 1e6 cannot tell.
        assert abs(value - number) <= 0.5 * last / STEPS + 1e-9


@given(st.lists(st.floats(1e-7, 1e5), min_size=1, max_size=30))
def test_durations_are_sorted_as_seconds_whatever_their_unit(seconds):
    column, blobs = written([duration(one) for one in seconds], seconds)
    for second, value in zip(seconds, values(blobs, column), strict=True):
        # Three digits are shown, and 254ths of the last one: 1/100/254/2 at worst, 1 % below 1 µs, where digits end.
        assert math.isclose(value, second, rel_tol=2.1e-5 if second >= 0.9995e-6 else 2e-4)


def test_an_interval_is_sorted_by_its_middle_and_a_mark_behind_a_number_is_no_part_of_it():
    shown = [
        interval(1.0, 2.0, "N"),
        interval(-3.0, 1.0, "N"),
        "2–5",
        "12.3 ms ‖4",
        "12.3 ms [A]",
        "0.500 † ‡",
        "–",
        "a",
    ]
    column, blobs = written(shown)
    told = values(blobs, column)
    assert told == [pytest.approx(one) if one is not None else None
                    for one in (1.5, -1.0, 3.5, 0.0123, 0.0123, 0.5, None, None)]  # fmt: skip


def test_what_has_no_value_has_none_though_it_shows_a_number():
    column, blobs = written(["1.0", "2.0", "3.0"], [1.0, None, math.nan])
    assert values(blobs, column) == [1.0, None, None]


@pytest.mark.parametrize("others", [1, 100])
def test_a_value_that_is_not_what_its_text_shows_is_kept_as_it_is(others):
    column, blobs = written(["1.0", *["2.0"] * others], [123.5, *[2.0] * others])
    assert values(blobs, column)[0] == 123.5


def test_numbers_beyond_what_a_browser_counts_to_stay_text():
    shown = ["12345678901234567890.5", "1e-05", "1.2.3.4"]
    column, blobs = written(shown)
    assert texts(blobs, column) == shown
