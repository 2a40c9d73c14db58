"""Events in time: frames on each stream's own clock, detectors, alarms and their figures, from recordings in files."""

from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable, PluginContractError
from tactbench.core.evaluation.channels import SlipReference
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.event_answers import EventRules, Scored
from tactbench.core.evaluation.protocols import protocol_called
from tactbench.core.evaluation.summaries import frame_features, frame_times, framed, summary_of
from tactbench.core.events.labels import SlipLabels
from tactbench.core.plugins.registry import load_registry
from tactbench.core.samples import StreamReadings
from tactbench.core.spec.events import AREA_PER_MINUTE
from tactbench.plugin import Summary
from tactbench.tasks import slip
from tests.core.evaluation.made import evaluated
from tests.core.evaluation.made_slip import campaign, record
from tests.core.events.made import policy

RATE, LATENCY = "false alarms per minute", "onset latency p50 ms"
COMPUTE = "compute s per s of signal"
REGISTRY = load_registry()
RULES = protocol_called("deployable")
TASK = slip.SPEC.model_copy(update={"scenes": (), "splits": ("roles", "session")})


def never_alarms(result):
    return any("never alarms" in one for one in result.remarks)


def run(paths, estimator="pac-band", asked=TASK, split=None, **more):
    return evaluated(asked, paths, estimator, split=split, **more)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    return campaign(tmp_path_factory.mktemp("campaign"))


@pytest.mark.parametrize(
    "summary",
    [Summary(measure="deviation"), Summary(measure="mean-step", start=0.5),
     Summary(measure="mean", start=0.2, end=0.6)],
    ids=lambda summary: summary.name,
)  # fmt: skip
def test_a_frame_is_the_summary_of_its_own_samples(paths, summary):
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.2, 1.8, 400)) / 200.0  # uneven: nothing is resampled
    stream = StreamReadings("made", ("a", "b"), ("taxel", "taxel"), rng.normal(40.0, 3.0, (400, 2)), time_s, 200.0)
    table = replace(load_dataset(TASK, paths[:1]).tables[0], readings=(stream,))
    untared = protocol_called("deployable-untared")
    frames = frame_times(table, TASK, untared)
    estimator = REGISTRY.estimators["frame-difference"].model_copy(update={"summaries": (summary,)})
    _, X = frame_features(TASK, untared, estimator)(table, frames)
    begin, end = 0.1 * np.array([summary.start, summary.end]) - 0.1
    for found, at_s in zip(X[::17], frames[::17] * 1e-9, strict=True):
        inside = (time_s > at_s + begin) & (time_s <= at_s + end)
        alone = replace(stream, data=stream.data[inside], time_s=time_s[inside])
        expected = summary_of(alone, Summary(measure=summary.measure), "made")
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("estimator", ["pac-band", "wavelet-energy", "slip-forest"])
def test_no_frame_knows_what_comes_after_it(paths, estimator):
    table = load_dataset(TASK, paths[:1]).tables[0]
    frames = frame_times(table, TASK, RULES)
    compute = frame_features(TASK, RULES, REGISTRY.estimators[estimator])
    later = tuple(replace(one, data=np.where((one.time_s > 2.5)[:, None], 1e3, one.data)) for one in table.readings)
    before = frames <= 2_500_000_000
    _, X = compute(table, frames)
    _, changed = compute(replace(table, readings=later), frames)
    assert 100 < before.sum() < len(before)
    np.testing.assert_array_equal(X[before], changed[before])
    assert (X[~before] != changed[~before]).any(axis=1).all()


def test_a_detector_of_vibration_finds_every_slip_and_nothing_else(paths):
    result = run(paths)
    assert (result.metric, result.score) == ("recall_area", 1.0)
    events = result.events
    assert (events["events"], events["misses"], events[RATE]) == (3, 0, 0)
    assert (events["alarms"], events["F1"]) == (3, 1.0)
    # The window of 0.1 s fills with louder samples after the onset, of which 10 ms (0.1 mm) pass before the label.
    # The policy asks for 20 ms of alarm more, and a frame ends every 10 ms.
    assert -10 <= events[LATENCY] <= 120
    assert (result.n_test, result.confusion, result.classes) == (9, None, [])  # three slips, six recordings
    assert any("1000 Hz" in one for one in result.remarks)


def test_the_oracle_is_right_and_the_trivial_answers_are_not(paths):
    assert run(paths, "force-ratio").score == 1.0
    for name in ("slip-never", "slip-always"):
        result = run(paths, name)
        assert result.score == 0.0
        assert result.events["misses"] == 3
        assert never_alarms(result) == (name == "slip-never")
    assert "precision" not in run(paths, "slip-never").events


def test_a_sensor_without_vibration_is_refused_with_its_band_or_answers_by_what_it_has(tmp_path):
    made = campaign(tmp_path, vibration=False)
    with pytest.raises(NotApplicable, match="50 Hz"):
        run(made)
    assert run(made, "wavelet-energy").score > 0.5


def test_the_threshold_comes_from_validation_alone(paths, tmp_path):
    quiet = [path for path in paths if not path.stem.startswith("test")]
    silent = campaign(tmp_path, ("test",), loud=1.0)
    loud, other = run(paths), run([*quiet, *silent])
    assert loud.chosen == other.chosen
    assert other.events["misses"] == 3  # nothing to hear in these
    assert other.score == 0.0


def test_without_validation_recordings_a_share_of_the_training_groups_serves(tmp_path):
    paths = [
        record(tmp_path / f"{session}-{place}-{slips}.h5", slips=slips, seed=100 * number + 10 * place + slips,
               role="test" if session == "c" else "train", session=session)
        for number, session in enumerate("abc") for place in range(2) for slips in (True, False)
    ]  # fmt: skip
    result = run(paths)
    assert any("role validation" in one for one in result.remarks)
    assert result.score == 1.0
    with pytest.raises(DataError, match="divided"):
        run([*paths[:2], *paths[-4:]])


def test_a_detector_that_alarms_at_no_threshold_that_is_allowed_is_scored_by_those_that_are_not(tmp_path):
    """Taps are louder than slips: one tap in 4 s is 15 a minute, of the 20 up to which the area goes."""
    for name, loud in (("heard", 3.0), ("silent", 1.0)):
        (tmp_path / name).mkdir()
        result = run(campaign(tmp_path / name, number=2, loud=loud, tapped=5.0))
        assert result.events["recall"] == 0
        assert never_alarms(result)
        assert result.score == pytest.approx(0.25 if name == "heard" else 0.0, abs=0.1)


def test_a_threshold_of_its_own_is_the_one_point_of_its_curve(paths):
    """Scores of 0 and 1 at 0.5: every slip at a rate of false alarms r is worth 1 - r over the largest rate."""
    own = REGISTRY.estimators["pac-band"].model_copy(update={"threshold": 0.0})
    result = run(paths, own)
    rate = result.events[RATE]
    assert result.score == pytest.approx(result.events["recall"] * (1 - rate / AREA_PER_MINUTE))


def test_without_disturbances_or_a_reference_nothing_is_answered_and_what_is_missing_is_named(paths, tmp_path):
    with pytest.raises(DataError, match="disturbance"):
        run([path for path in paths if path.stem.endswith("slip")])
    path = record(tmp_path / "blind.h5", slips=True, seed=1, reference=False)
    with pytest.raises(NotApplicable, match="'blind'"):
        load_dataset(TASK, [path])


@pytest.mark.parametrize("friction", ["smooth", "0", "inf"])
def test_a_coefficient_of_friction_is_a_number_above_zero(tmp_path, friction):
    with pytest.raises(DataError, match=repr(friction)):
        load_dataset(TASK, [record(tmp_path / "a.h5", slips=True, seed=1, friction=friction)])


def test_a_reference_is_looked_up_until_its_last_interval_is_over_and_events_from_the_first_frame_on():
    t_ns, some = np.arange(4) * 10, np.zeros(4)
    labels = SlipLabels(np.array([0, 1, 2, 2]), np.array([[0, 9], [20, 30], [30, 33], [31, 35]]))
    reference = SlipReference(t_ns, some, some, labels, False)
    assert reference.state(np.array([-1, 0, 9, 10, 40, 41])).tolist() == [-1, 0, 0, 1, 2, -1]
    ends_ns = np.array([20, 25, 30])
    truth = reference.truth(ends_ns)
    scored = Scored(ends_ns, np.array([0.0, 0.5, 0.0]), truth, 0)
    assert EventRules(policy(), 1.0, 0.5, 5).curve([scored]).threshold.tolist() == [1.0, np.inf], "0.5 is reached"
    assert (truth.event_ns.tolist(), truth.span_ns) == ([[20, 30], [30, 33]], (20, 31))


def test_compute_time_delays_alarms_and_changes_no_hit(paths):
    at_once, timed = run(paths).events, run(paths, latency=True)
    parts, late = timed.delay_parts_ms, timed.events
    assert (parts["window"], parts["sampling"]) == pytest.approx((50.0, 10.0))
    spent_ms = parts["features"] + parts["prediction"]
    assert late[COMPUTE] == pytest.approx(spent_ms / 10.0)
    assert late[LATENCY] == pytest.approx(at_once[LATENCY] + spent_ms)
    same = ("events", "misses", "precision", "recall", RATE)
    assert [late[name] for name in same] == [at_once[name] for name in same]


@pytest.mark.parametrize("protocol", ["karl2016", "deployable@k=3", "deployable@every=2"])
def test_frames_are_windows_of_all_samples(paths, protocol):
    with pytest.raises(NotApplicable, match=protocol):
        run(paths, protocol=protocol)


def test_code_for_features_must_give_a_line_a_frame(paths):
    wrong = REGISTRY.estimators["wavelet-energy"].model_copy(update={"frames_by": f"{__name__}:one_line"})
    with pytest.raises(PluginContractError, match=r"\(1, 1\)"):
        framed(load_dataset(TASK, paths[:1]), TASK, RULES, wrong)


def one_line(stream, ends_s, window_s):
    return np.zeros((1, 1))
