"""Which sensor meets a wish: what is unknown is not met, margins have the right sign, nothing trivial is proposed."""

from dataclasses import asdict

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.choosing.choosing import Wish, choose
from tactbench.core.spec.task import PlannedScene
from tactbench.plugin import ChannelSpec, DataSheet, PhysicalRange, Scene, SensorSpec, Source, StreamSpec
from tests.core.leaderboard.rows import TASK, row

PRESSED = TASK.model_copy(update={"scenes": (PlannedScene(scene=Scene(name="press"), role="test"),)})
"""Presses to 5 N."""
F1 = PRESSED.model_copy(update={"metric": "macro_f1", "unit": "1", "kind": "classification"})
STATED = Source(tag="sourced", reference="a data sheet")
ASSUMED = Source(tag="assumed", reference="nobody")


def sensor(name="a", rate=100.0, rate_source=STATED, upper=10.0, range_source=STATED, **sheet):
    force = PhysicalRange(lower=0.0, upper=upper, unit="N", source=range_source) if upper else None
    stream = StreamSpec(name="taxels", rate_hz=rate, rate_source=rate_source,
                        channels=(ChannelSpec(name="t1", kind="taxel"),))  # fmt: skip
    return SensorSpec(name=name, title=name, principle="none", principle_source=STATED, streams=(stream,),
                      data_sheet=DataSheet(force_range=force, **sheet))  # fmt: skip


def answer(name="a", score=0.5, delay=1.0, **more):
    parts = {"sampling": 0.0, "link": 0.0, "window": 0.0, "features": 0.0, "prediction": delay}
    told = {"baseline": 2.0, "looks_at": "features", "answer_delay_ms": delay, "delay_parts_ms": parts}
    return row(name, score=score, **(told | more))


def only(rows, wish, *sensors, task=PRESSED):
    (choice,) = choose(rows, wish, task, {one.name: one for one in sensors or (sensor(),)})
    return choice


def states(choice, place=0):
    return {one.wish: one.state for one in choice.candidates[place].criteria}


def test_simulated_and_measured_rows_are_apart():
    measured, simulated = choose([answer(), answer("b", simulated=False)], Wish(), PRESSED, {})
    assert (measured.hardware, simulated.hardware) == ("rig twin", "SIM")


def test_a_miss_says_by_how_much():
    choice = only([answer()], Wish(max_delay_ms=0.4))
    (criterion,) = choice.candidates[0].criteria
    assert criterion.state == "missed"
    assert choice.verdict == "None meets all: nearest is a SIM / lasso, answer delay 1.00 ms, 600 µs too slow."


def test_a_delay_that_lacks_a_part_is_a_lower_bound():
    """A wish that is missed without it is missed with it; one that is met without it is unknown."""
    for sampling_ms, state in ((2.0, "missed"), (1.0, "unknown")):
        more = {"answer_delay_ms": sampling_ms + 0.5, "delay_parts_ms": {"sampling": sampling_ms, "prediction": 0.5}}
        assert states(only([answer(**more)], Wish(max_delay_ms=2))) == {"answer delay": state}


def test_errors_of_force_are_those_beyond_the_floor_if_all_have_one():
    floored = {"score_beyond_floor": 0.1, "beyond_floor_ci_low": 0.0, "beyond_floor_ci_high": 0.3}
    choice = only([answer(**floored), answer("b", **(floored | {"score_beyond_floor": 0.05}))], Wish(score=0.2))
    assert [(one.score, one.low, one.high) for one in choice.candidates] == [(0.05, 0.0, 0.3), (0.1, 0.0, 0.3)]
    plain = only([answer(**floored), answer("b")], Wish())
    assert {one.score for one in plain.candidates} == {0.5}


def test_what_is_no_better_than_a_trivial_answer_is_never_proposed():
    worse = answer("bad", score=2.0)  # as bad as the mean
    trivial = answer("a", estimator="mean", score=0.1)
    forest, defined = answer(estimator="forest", score=0.1, delay=20.0), answer("oracle", score=0.0)
    rows = [forest, answer(), worse, trivial, defined]
    choice = only(rows, Wish(max_delay_ms=2), sensor(), sensor("bad"), sensor("oracle", exists=False))
    assert [(one.row["sensor"], one.estimator) for one in choice.candidates] == [("a", "lasso")]
    assert [text.partition(":")[0] for text in choice.left_out] == ["bad", "oracle"]
    alone = only([worse], Wish(max_delay_ms=2), sensor("bad"))
    assert alone.candidates == ()
    assert alone.verdict.startswith("Cannot say")


def test_order_all_met_then_fewest_unknown_then_least_missed():
    rows = [
        answer("missed", score=0.01), answer("slower", score=0.02, delay=9.0), answer("unknown", score=0.03),
        answer("worse", score=0.5), answer("better", score=0.4), answer("guessed", score=0.3),
    ]  # fmt: skip
    sensors = (
        sensor("missed", upper=4.0), sensor("slower", upper=4.0), sensor("unknown", upper=None, rate=None),
        sensor("worse"), sensor("better"), sensor("guessed", upper=None),
    )  # fmt: skip
    choice = only(rows, Wish(max_delay_ms=2, range_n=5, rate_hz=10), *sensors)
    order = [one.row["sensor"] for one in choice.candidates]
    assert order == ["better", "worse", "guessed", "unknown", "missed", "slower"]
    assert choice.verdict == "better SIM / lasso meets all 3 wishes; worse SIM / lasso too."


maybe = st.none() | st.floats(0.1, 100)
sources = st.sampled_from([STATED, ASSUMED, None])


@given(delay=maybe, link=st.booleans(), rate=maybe, rate_source=sources, upper=maybe,
       range_source=st.sampled_from([STATED, ASSUMED]), score=st.floats(0.01, 3.0), trivial=maybe,
       wish=st.builds(Wish, maybe, maybe, maybe, maybe))  # fmt: skip
def test_met_means_known_and_good_enough(delay, link, rate, rate_source, upper, range_source, score, trivial, wish):
    parts = {"sampling": 0.0, "window": 0.0, "features": 0.0, "prediction": delay, **({"link": 0.0} if link else {})}
    made = sensor(rate=rate, rate_source=rate_source, upper=upper, range_source=range_source)
    told = answer(score=score, baseline=trivial, answer_delay_ms=delay, delay_parts_ms=parts, latency_ms_p50=0.02)
    choice = only([told], wish, made)
    if not choice.candidates:
        assert score >= trivial
        return
    (one,) = choice.candidates
    stated = rate is not None and rate_source is STATED
    good = {
        "answer delay": stated and link and delay is not None and delay <= (wish.max_delay_ms or 0),
        "rate": stated and rate >= (wish.rate_hz or 0),
        "force range": upper is not None and range_source is STATED and upper >= (wish.range_n or 0),
        "score": wish.score is not None and score <= wish.score and (wish.range_n or 0) <= 5,
        "trivial answer": False,
    }
    for criterion in one.criteria:
        assert (criterion.state == "met") == good[criterion.wish], asdict(criterion)
        assert (criterion.relative > 0) == (criterion.state == "missed")
        assert (criterion.value is None) == (criterion.state == "unknown")
    proposed = "meets" in choice.verdict and "None" not in choice.verdict
    assert proposed == (bool(one.criteria) and all(criterion.state == "met" for criterion in one.criteria))
