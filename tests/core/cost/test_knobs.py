"""What accuracy costs along each knob: settings are cells, reused, and the front is of those that answer the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.cost.knobs import Skipped, diagrams, measure, precise, quick_estimator, settings_of, simulations_of
from tactbench.core.cost.knobs import measured as measured_twin
from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.plugins.interfaces import CostJob, CostStudy
from tactbench.core.plugins.registry import load_registry
from tactbench.core.progress import Progress
from tactbench.core.report.figures.group import styled
from tactbench.core.report.figures.trade import draw_precision, draw_trade
from tactbench.core.spec.matrix import MatrixSpec, TaskChoice
from tactbench.plugin.simulation import CostPoint
from tests.core.evaluation.made import record
from tests.here import IN_THIS_PROCESS


def presses(folder, sessions=3, n=120):
    """Recordings of a force on three taxels, one a session."""
    rng = np.random.default_rng(4)
    folder.mkdir()
    for number in range(sessions):
        force = np.linspace(0.0, 5.0, n) + rng.normal(0.0, 0.1, n)
        X = force[:, None] * np.array([40.0, -25.0, 10.0]) + rng.normal(0.0, 60.0, (n, 3)) + 100.0
        record(folder / f"press-{number}.h5", X, force, session=str(number))
    return folder


@pytest.fixture(scope="module")
def shelf(tmp_path_factory):
    return presses(tmp_path_factory.mktemp("knobs") / "shelf")


@pytest.fixture(scope="module")
def registry():
    return load_registry()


def measured(shelf, out, names, keep=lambda one: True):
    registry = load_registry()
    chosen = [registry.estimators[name] for name in names]
    settings = [one for one in settings_of(registry.tasks["force"].spec, chosen, "deployable") if keep(one)]
    matrix = MatrixSpec(rig="replay", repeats=1, sensors=("made",), tasks=(TaskChoice(name="force"),))
    return measure(matrix, settings, out, recordings=shelf, choice=IN_THIS_PROCESS, progress=Progress())


@pytest.fixture(scope="module")
def known(shelf, tmp_path_factory):
    return measured(
        shelf, tmp_path_factory.mktemp("out"), ["forest-10", "ols"], lambda one: one.value not in ("100", "300")
    )


def test_one_knob_is_varied_and_all_others_stay_as_they_are(known):
    settings = {(one["knob"], one["value"]): one for one in known["settings"]}
    base = settings["estimator", "forest-10"]
    for same in (("trees", "10"), ("window k", "0"), ("every n-th sample", "1")):
        assert (settings[same]["score"], settings[same]["fit_s"]) == (base["score"], base["fit_s"]), "one cell"
    assert settings["trees", "30"]["latency_ms_p50"] > settings["trees", "3"]["latency_ms_p50"]
    # 100 Hz: a window of 21 is late by ten intervals; every tenth sample is waited for ten times as long.
    assert settings["window k", "20"]["delay_parts_ms"]["window"] == pytest.approx(100.0)
    assert settings["every n-th sample", "10"]["delay_parts_ms"]["sampling"] == pytest.approx(100.0)
    assert settings["every n-th sample", "10"]["n_test"] * 10 == base["n_test"]
    assert settings["training sessions", "1"]["status"] != "done"
    assert settings["training sessions", "1"]["reason"]


def test_the_front_is_beaten_by_no_setting_of_a_knob_that_competes(known):
    competing = [
        one for one in known["settings"] if one["knob"] in ("trees", "window k", "every n-th sample", "estimator")
    ]
    best = [one for one in competing if one["front"]]
    assert best
    for one in competing:
        assert any(o["answer_delay_ms"] <= one["answer_delay_ms"] and o["score"] <= one["score"] for o in best)
    assert not any(one["front"] for one in known["settings"] if one["knob"] in ("protocol", "training sessions"))
    assert all(one["score"] < known["trivial"] for one in best)


def test_what_was_finished_is_found_again(shelf, tmp_path):
    few = measured(shelf, tmp_path, ["ols"], lambda one: one.knob == "window k")
    again = measured(shelf, tmp_path, ["ols"])
    times = {one["value"]: one["fit_s"] for one in again["settings"] if one["knob"] == "window k"}
    assert times == {one["value"]: one["fit_s"] for one in few["settings"]}, "nothing is timed twice"


def test_the_figure_has_a_path_for_each_knob_and_a_panel_for_each_sensor(known):
    with styled():
        drawn = draw_trade(known)
        panels = draw_precision([cost_point(t, 1 / t, subject=name) for name in "ab" for t in (1, 2)], "Two").axes
    assert drawn.axes[0].xaxis.get_major_formatter()(20.0) == "20"
    assert [panels[0].yaxis.get_minor_formatter()(one) for one in (0.5, 0.3)] == ["0.5", ""]
    paths = {line.get_label(): line for axes in drawn.axes for line in axes.get_lines()}
    for knob in ("trees", "window k", "every n-th sample"):
        own = [one for one in known["settings"] if one["knob"] == knob]
        assert list(paths[knob].get_xdata()) == [one["answer_delay_ms"] for one in own]
        assert list(paths[knob].get_ydata()) == [one["score"] for one in own]
    for axes in panels:
        points, noise = axes.get_lines()
        assert (list(points.get_xdata()), list(points.get_ydata())) == ([1, 2], [1, 0.5])
        assert noise.get_ydata()[0] == pytest.approx(0.1)


def test_settings_are_the_defaults_and_values_on_either_side(registry):
    force, forest = registry.tasks["force"].spec, registry.estimators["forest"]
    values = {}
    for one in [
        *settings_of(force, [forest], "deployable"),
        *simulations_of(registry.rigs["twin"], forest, "karl2016"),
    ]:
        values.setdefault(one.knob, []).append(one.value)
    of_recordings = settings_of(registry.tasks["slip-sequence"].spec, [forest], "deployable")
    assert "window k" not in {one.knob for one in of_recordings}
    assert values == {
        "trees": ["3", "10", "30", "100", "300", "500"], "window k": ["0", "2", "5", "10", "20", "40"],
        "every n-th sample": ["1", "2", "5", "10", "20"], "training sessions": ["1", "2", "5", "10"],
        "estimator": ["forest"], "rung": list(registry.rigs["twin"].rungs[:-1]), "tolerance": ["3", "1", "0.3"],
    }  # fmt: skip


def test_the_quick_estimator_is_linear_and_searches_nothing(registry, monkeypatch):
    assert [quick_estimator(registry, task) for task in ("force", "slip")] == ["ols", "slip-spectrum"]
    monkeypatch.setattr(registry, "tasks", {"own": registry.tasks["force"]})
    spec = registry.tasks["own"].spec.model_copy(update={"estimators": ()})
    registry.tasks["own"] = registry.tasks["own"].model_copy(update={"spec": spec})
    assert registry.estimators[quick_estimator(registry, "own")].linear
    registry.tasks["own"] = registry.tasks["own"].model_copy(update={"spec": spec.model_copy(update={"kind": "none"})})
    with pytest.raises(UsageError, match="own"):
        quick_estimator(registry, "own")


def test_a_measurement_that_is_not_possible_is_a_line_and_points_are_in_order_of_time():
    def refuses():
        raise NotApplicable("no film", hint="")

    points = [cost_point(2.0, 0.1), cost_point(1.0, 0.2), cost_point(1.0, 0.5, subject="dome")]
    jobs = [CostJob("a", lambda: points), CostJob("b", refuses)]
    found = list(measured_twin(CostStudy("t", "r", jobs), "pad", Progress()))
    assert found == [*points, Skipped("pad", "b", "no film")]
    assert diagrams(points) == {("pad", "taxel"): points[1::-1], ("dome", "taxel"): points[2:]}


def cost_point(seconds, error, *, subject="pad"):
    return CostPoint(
        subject=subject, observable="taxel", label="way", seconds=seconds, error=error, worst=2 * error, unit="count",
        floor=0.3,
    )  # fmt: skip


POSITIVE = st.floats(1e-6, 1e3)


@given(st.lists(st.tuples(POSITIVE, POSITIVE), min_size=1, max_size=20))
def test_no_point_beats_the_front_and_the_front_beats_all_others(pairs):
    points = [cost_point(*pair) for pair in pairs]
    best = precise(points)
    for point in points:
        assert any(one.seconds <= point.seconds and one.error <= point.error for one in best)
    for one in best:
        assert not any(other.seconds < one.seconds and other.error <= one.error for other in points)
    assert [one.error for one in best] == sorted((one.error for one in best), reverse=True)
