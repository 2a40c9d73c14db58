"""The front of anything that takes time and is off by something."""

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.cost.front import front


def best(pairs):
    return front(pairs, seconds=lambda pair: pair[0], error=lambda pair: pair[1])


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=30))
def test_nobody_on_the_front_is_beaten_and_everybody_else_is(pairs):
    kept = best(pairs)
    for seconds, error in pairs:
        beaten = any(s <= seconds and e <= error and (s, e) != (seconds, error) for s, e in pairs)
        assert ((seconds, error) in kept) != beaten
    assert kept == sorted(set(kept)), "quickest first, equals once"


def test_a_score_to_be_maximised_is_given_with_its_sign_changed():
    scores = [(1.0, 0.5), (2.0, 0.4), (3.0, 0.9)]
    assert front(scores, seconds=lambda p: p[0], error=lambda p: -p[1]) == [(1.0, 0.5), (3.0, 0.9)]
    assert best(scores) == [(1.0, 0.5), (2.0, 0.4)]


def test_nothing_has_an_empty_front():
    assert best([]) == []
