"""Which sensor meets requirements: what is unknown is not met, nothing trivial is proposed, the nearest come first."""

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.leaderboard.requirements import Requirements, with_requirements
from tactbench.core.leaderboard.table import build_table
from tactbench.core.spec.task import PlannedScene
from tactbench.plugin import ChannelSpec, DataSheet, PhysicalRange, Scene, SensorSpec, Source, StreamSpec
from tests.core.leaderboard.rows import TASK, row

PRESSED = TASK.model_copy(update={"scenes": (PlannedScene(scene=Scene(name="press"), role="test"),)})
"""Presses to 5 N."""
STATED = Source(tag="sourced", reference="a data sheet")
ASSUMED = Source(tag="assumed", reference="no source")


def sensor(name="a", rate=100.0, rate_source=STATED, upper=10.0, range_source=STATED, **sheet):
    force = PhysicalRange(lower=0.0, upper=upper, unit="N", source=range_source) if upper else None
    stream = StreamSpec(name="taxels", rate_hz=rate, rate_source=rate_source,
                        channels=(ChannelSpec(name="t1", kind="taxel"),))  # fmt: skip
    return SensorSpec(name=name, title=name, principle="none", principle_source=STATED, streams=(stream,),
                      data_sheet=DataSheet(force_range=force, **sheet))  # fmt: skip


def answer(name="a", score=0.5, delay=1.0, **more):
    parts = {"sampling": 0.0, "link": 0.0, "window": 0.0, "features": 0.0, "prediction": delay}
    known = {"baseline": 2.0, "looks_at": "features", "delay_parts_ms": parts, "n_replicates": 8}
    return row(name, score=score, **(known | {"cell": f"{name}/{more.get('estimator')}"} | more))


def only(rows, required, *sensors):
    (block,) = with_requirements(
        build_table(rows), required, PRESSED, {one.name: one for one in sensors or (sensor(),)}
    ).blocks
    return block


def meeting(block):
    """Return the sensors that meet all requirements, by the sentence above the table."""
    return block.verdict[0].partition(" met by ")[2].removesuffix(".").split(", ") * ("All" in block.verdict[0])


def state(block, column):
    return block.lines[0].texts[column].partition(":")[0]


def test_a_delay_that_lacks_a_part_is_a_lower_bound():
    """What is too slow without it is too slow with it; what is not may be."""
    for sampling_ms, expected in ((2.0, "missed"), (1.0, "unknown")):
        block = only([answer(delay_parts_ms={"sampling": sampling_ms, "prediction": 0.5})], Requirements(2.0))
        assert state(block, "answer delay") == expected


def test_trivial_answers_and_definitions_come_last_and_are_never_proposed():
    rows = [
        answer(estimator="forest", score=0.1, delay=20.0), answer(), answer("bad", score=2.0),
        answer(estimator="mean", score=0.1, is_baseline=True), answer("oracle", score=0.01),
    ]  # fmt: skip
    block = only(rows, Requirements(2.0), sensor(), sensor("bad"), sensor("oracle", exists=False))
    assert [line.row["estimator"] for line in block.lines if line.row["sensor"] == "a"] == ["lasso", "forest"]
    assert {line.row["sensor"] for line in block.lines[:2]} == {"a"}
    refused = {line.row["sensor"] for line in block.lines if line.texts["answer"].startswith("missed")}
    assert refused == {"bad", "oracle"}
    assert meeting(block) == ["a SIM"]
    assert meeting(only([answer("bad", score=2.0)], Requirements(2.0), sensor("bad"))) == []


def test_fewest_missed_come_first_then_fewest_unknown_then_the_better_score():
    rows = [
        answer("missed", score=0.01), answer("slower", score=0.02, delay=9.0), answer("unknown", score=0.03),
        answer("worse", score=0.5), answer("better", score=0.4), answer("guessed", score=0.3),
    ]  # fmt: skip
    sensors = (
        sensor("missed", upper=4.0), sensor("slower", upper=4.0), sensor("unknown", upper=None, rate=None),
        sensor("worse"), sensor("better"), sensor("guessed", upper=None),
    )  # fmt: skip
    block = only(rows, Requirements(2.0, 5.0, 10.0), *sensors)
    order = [line.row["sensor"] for line in block.lines]
    assert order == ["better", "worse", "guessed", "unknown", "missed", "slower"]
    assert meeting(block) == ["better SIM", "worse SIM"]


def test_scores_hold_up_to_the_force_that_was_pressed():
    for required, noted in ((5.0, False), (6.0, True)):
        assert ("5 N" in str(only([answer()], Requirements(range_n=required)).notes)) == noted


maybe = st.none() | st.floats(0.1, 100)
sources = st.sampled_from([STATED, ASSUMED, None])


@given(delay=maybe, link=st.booleans(), rate=maybe, rate_source=sources, upper=maybe, score=st.floats(0.01, 3.0),
       range_source=st.sampled_from([STATED, ASSUMED]), trivial=maybe, required=st.builds(Requirements, maybe, maybe,
       maybe))  # fmt: skip
def test_met_means_known_and_good_enough(delay, link, rate, rate_source, upper, range_source, score, trivial, required):
    parts = {"sampling": 0.0, "window": 0.0, "features": 0.0}
    parts |= {"prediction": delay} if delay else {}
    parts |= {"link": 0.0} if link else {}
    made = sensor(rate=rate, rate_source=rate_source, upper=upper, range_source=range_source)
    block = only([answer(score=score, baseline=trivial, delay_parts_ms=parts, latency_ms_p50=0.02)], required, made)
    stated = rate is not None and rate_source is STATED
    good = {
        "answer delay": stated and link and delay is not None and delay <= (required.max_delay_ms or 0),
        "rate": stated and rate >= (required.rate_hz or 0),
        "force range": upper is not None and range_source is STATED and upper >= (required.range_n or 0),
    }
    better = trivial is None or score < trivial
    named = dict(zip(good, (required.max_delay_ms, required.rate_hz, required.range_n), strict=True))
    for column, met in good.items():
        assert (state(block, column) == "met") == (met and better and named[column] is not None)
    all_met = trivial is not None and better and all(met for name, met in good.items() if named[name] is not None)
    if required != Requirements():
        assert block.verdict[0].startswith("All requirements") == all_met
