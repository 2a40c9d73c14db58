"""What models compute from what they declare, and how they are written in tables and messages."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.report.datasheet import OF_DEVICES
from tactbench.core.spec import profile
from tactbench.core.spec.events import SlipTarget, nanoseconds
from tactbench.core.spec.matrix import EstimatorChoice, TaskChoice
from tactbench.core.spec.quantity import assumed, derived, measured, sourced
from tactbench.core.spec.rig import Parameter
from tactbench.core.spec.row import FORMAT, JSON_KEYS, OF_REPLICATES, RowModel, lower_is_better, plural
from tactbench.core.spec.scene import RANGES, Environment, Indenter, Slide
from tactbench.core.spec.sensor import Nuisances
from tactbench.core.spec.skin import SheetTable
from tactbench.core.spec.task import DeclaredTask, PlannedScene, Published, in_drawn_order
from tactbench.plugin import (
    ChannelSpec,
    ForcePath,
    ForceRamp,
    LabelTarget,
    Scene,
    SensorSpec,
    Source,
    StreamSpec,
    Summary,
    VectorTarget,
    load_registry,
)  # fmt: skip
from tests.core.evaluation.made import force_task, sensor
from tests.core.events.made import policy
from tests.core.leaderboard.rows import row

REGISTRY = load_registry()
FORCE = REGISTRY.tasks["force"].spec
WHY = Source(tag="assumed", reference="a test")
FRAMES = SlipTarget(hop_s=0.01, window_s=0.1)
MEAN = (Summary(measure="mean"),)
LABEL = {"kind": "classification", "metric": "macro_f1", "target": LabelTarget(name="a"), "unit": "1"}


def q(value, unit="mm"):
    return assumed(value, unit, "a test")


def from_frames(**more):
    return force_task(**{**LABEL, "target": FRAMES, "answer_per": "frame", "summaries": MEAN, **more})


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (q(0.5), "0.5 mm"),
        (Indenter(), "flat"),
        (Indenter(radius=q(2)), "cap R 2 mm"),
        (Indenter(shape="pin", dimensions={"r": q(2)}, angle=q(30, "deg")), "pin r 2 mm, turned by 30 deg"),
        (Indenter(shape="pin"), "pin"),
        (Slide(speed=q(5, "mm/s")), "5 mm/s from 30 s on"),
        (Parameter(default=1, unit="mm", text="t", least=0.5).range, "0.5 mm or more"),
        (Parameter(default=1, unit="1", text="t", most=3).range, "0 to 3"),
        (MEAN[0].name, "mean"),
        (Summary(measure="mean", end=0.5, kinds=("taxel",)).name, "mean 0-0.5 of the recording of taxel"),
        (Summary(measure="band-energy", band_hz=(5, 20)).name, "band-energy 5-20 Hz"),
        (force_task().answer_from, ""),
        (force_task(**LABEL, answer_per="recording", splits=(), summaries=MEAN).answer_from, "mean"),
        (from_frames(splits=()).answer_from, str(FRAMES)),
        (plural("session"), "sessions"),
        (plural("press"), "presses"),
    ],
)  # fmt: skip
def test_how_a_value_is_written(value, written):
    assert str(value) == written


def test_how_the_alarms_of_a_task_are_written():
    alarms = from_frames(
        kind="events", metric="recall_area", splits=(), alarms=policy(), max_false_alarms_per_minute=1.0
    ).answer_from
    for part in (str(FRAMES), str(policy()), "20 false alarms a minute", "at most 1 a minute"):
        assert part in alarms
    for part in ("0.05 s before", "0.2 s after", "non-events"):
        assert part in str(policy())


def test_which_metrics_are_errors():
    given = ("rmse", "true_rmse", "mae", "own (lower is better)", "r2", "macro_f1", "own (higher is better)")
    assert [lower_is_better(one) for one in given] == [True] * 4 + [False] * 3


def test_quantities_have_the_tag_of_their_maker_and_times_are_whole_nanoseconds():
    made = (sourced, measured, derived, assumed)
    assert [one(1.5, "mm", "why").source.tag for one in made] == [one.__name__ for one in made]
    assert sourced(1.5, "mm", "why") == sourced(1.5, "mm", "why").model_copy(update={"value": 1.5})
    assert (nanoseconds(5.0), nanoseconds(1.4e-9)) == (5_000_000_000, 1)


def test_named_profiles_without_parameters():
    stairs, sine = profile.staircase(), profile.sine()
    levels = [1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0]
    assert stairs.forces_n == (0, 0, *np.repeat(levels, 2))
    assert stairs.times_s == (0, 3, *np.cumsum([0.5, 3.0] * 10) + 3)
    assert (stairs.samples, sine.samples) == (3800, 2800)
    t = np.array(sine.times_s[2:])
    assert (len(t), t[0], t[-1]) == (641, 4.0, pytest.approx(14.0))
    np.testing.assert_allclose(sine.forces_n[2:], 2 - np.cos(2 * np.pi * (t - 4)), atol=1e-9)
    assert profile.staircase(steps=1, dwell=0, hold=0, rise=1e-3, rate=1).samples == 1
    assert min(profile.sine(mean=1, amplitude=1).forces_n[2:]) == 0
    assert profile.staircase(steps=1, hold=0).times_s[:2] == (0, 0.5)


def test_bare_names_in_a_matrix_are_lists_and_choices():
    task = TaskChoice(name="force", protocol="karl2016", split=None, estimators=("lasso", {"name": "ols"}))
    assert (task.protocol, task.split) == (("karl2016",), ())
    assert task.estimators == (EstimatorChoice(name="lasso"), EstimatorChoice(name="ols"))
    assert TaskChoice(name="force", split=["a", "b"]).split == ("a", "b")


def test_what_a_declared_task_states_stands_in_its_spec():
    stated = {"title": "T", "question": "Q?", "metric": "mae", "estimators": ("ols",), "baselines": ("mean",)}
    target = {"source": "channel", "kind": "force", "name": "fz", "unit": "mN"}
    spec = DeclaredTask.model_validate({"name": "push", "target": target, "splits": ["session"], **stated}).spec
    assert {name: getattr(spec, name) for name in stated} == stated
    assert spec.unit == "mN"
    components = VectorTarget(names=("x", "y"), unit="mm").components
    assert [(one.kind, one.name, one.unit) for one in components] == [("position", "x", "mm"), ("position", "y", "mm")]


@pytest.mark.parametrize(
    ("asked", "score"),
    [
        (("icub", "karl2016", "lasso", None), 3.0),
        (("biotac", "karl2016", "lasso", "roles"), 2.0),
        (("biotac", "karl2016", "forest", "roles"), 1.0),
        (("biotac", "karl2016", "forest", "session"), None),
        (("biotac", "deployable", "lasso", None), None),
    ],
)
def test_the_figure_that_is_published_of_most_of_a_row_stands_beside_it(asked, score):
    more = ({"split": "roles"}, {"split": "roles", "estimator": "lasso"}, {"sensor": "icub"})
    figures = [Published(score=n, reference="r", protocol="karl2016", **one) for n, one in enumerate(more, 1)]
    found = FORCE.model_copy(update={"published": tuple(figures)}).published_for(*asked)
    assert (found and found.score) == score


def test_members_of_a_drawn_group_share_out_their_places_and_times():
    def scene(name, start, group):
        return PlannedScene(scene=Scene(name=name, starts_after_s=start), role="train", drawn_order=group)

    planned = [scene(f"{n}", 60.0 * n, "caps" if n % 3 else "") for n in range(9)]
    orders = {tuple(one.scene.name for one in in_drawn_order(planned, seed)) for seed in range(5)}
    assert len(orders) > 1
    for order in orders:
        assert order[::3] == ("0", "3", "6"), "scenes of no group stay where they are"
        assert sorted(order) == [f"{n}" for n in range(9)]
    assert [one.scene.starts_after_s for one in in_drawn_order(planned, 1)] == [60.0 * n for n in range(9)]
    drawn = "".join(one.scene.name for one in in_drawn_order(planned, 1))
    assert drawn == "052387641", "recordings made with this seed are of this order"


def test_a_scenario_takes_the_place_of_the_usual_nuisances_and_is_known_by_name():
    biotac = REGISTRY.sensors["biotac"].spec
    assert biotac.handled(None) is biotac
    for name, scenario in biotac.scenarios.items():
        assert biotac.handled(name).nuisances == {**biotac.nuisances, **scenario.nuisances}
    with pytest.raises(NotApplicable, match="'no-such'"):
        biotac.handled("no-such")


def test_the_spec_of_a_sensor_is_of_its_first_unit():
    assert [Scene(name="s", unit=unit).first_unit for unit in ("1", "2")] == [True, False]


def test_offsets_have_the_scale_of_drift_unless_they_have_their_own():
    assert Environment(drift_scale=2).scale_of_offsets == 2
    assert Environment(drift_scale=2, offset_scale=0).scale_of_offsets == 0


def test_what_the_converter_and_white_noise_hide():
    """A step of a converter is uniform over itself: its standard deviation is a twelfth of its square."""
    own = Nuisances(white=q(3, "count"), step=q(2, "count"))
    assert own.hidden(2.0) == pytest.approx(math.sqrt(36 + 4 / 12))
    assert own.hidden() == pytest.approx(math.sqrt(9 + 4 / 12))


def test_a_table_over_the_sheet_is_straight_between_its_entries_and_even_beyond():
    table = SheetTable(x_mm=(0, 2, 3), angle_deg=(0, 90), value_mm=((1, 3), (5, 11), (9, 9)), source=WHY)
    found = table.at(np.array([-1.0, 0.0, 1.0, 2.0, 3.0, 4.0]), np.radians([-45.0, 0.0, 45.0, 120.0]))
    np.testing.assert_allclose(found, [[2, 1, 2, 3], [2, 1, 2, 3], [5, 3, 5, 7], [8, 5, 8, 11], [9] * 4, [9] * 4])
    assert (table.least_mm, table.most_mm) == (1, 11)
    line = SheetTable(x_mm=(0,), angle_deg=(0, 90), value_mm=((1, 3),), source=WHY)
    np.testing.assert_allclose(line.at(np.array([4.0]), np.radians([45.0])), [[2.0]])


# Force over time


PATH = ForcePath(times_s=(0.0, 0.5, 1.0, 2.0), forces_n=(0.5, 0.5, 3.0, 1.0), samples=100, source=WHY)


def ramp(hold_s):
    return ForceRamp(start=q(3.0, "N"), hold=q(hold_s, "s"))


@pytest.mark.parametrize(
    ("profile", "hold_s", "largest_n", "corners"),
    [
        (PATH, 0.5, 3.0, (PATH.times_s, PATH.forces_n)),
        (ramp(6), 6.0, 5.0, ((0.0, 6.0, 60.0), (3.0, 3.0, 5.0))),
        (ramp(60), 60.0, 5.0, ((0.0, 60.0), (3.0, 3.0))),
        (ramp(70), 60.0, 5.0, ((0.0, 60.0), (3.0, 3.0))),
    ],
)
def test_where_a_profile_begins_rests_and_ends(profile, hold_s, largest_n, corners):
    assert (profile.hold_s, profile.largest_n, profile.corners) == (hold_s, largest_n, corners)
    assert profile.duration.to("s") == corners[0][-1]
    scene = Scene(name="a", profile=profile)
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def test_a_profile_that_states_no_kind_is_a_ramp():
    assert isinstance(Scene.model_validate({"name": "a", "profile": {"samples": 5}}).profile, ForceRamp)


# Dimensions of indenters


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"length": q(2)}, "'length'"),
        ({"radius": q(2, "s")}, "radius: .*'mm'"),
        ({"radius": q(float("nan"))}, "radius .* nan mm"),
        ({"radius": q(0)}, "radius .* 0 mm"),
    ],
)
def test_a_dimension_that_cannot_be_is_named(given, says):
    with pytest.raises(UsageError, match=f"'cylinder': {says}"):
        REGISTRY.indenters["cylinder"].sizes(given)


def test_dimensions_come_in_the_unit_of_the_shape_and_others_by_default():
    assert REGISTRY.indenters["pin"].sizes({"radius": q(0.003, "m")}) == {"radius": 3.0, "fillet": 0.0}


# Sensors


def test_axes_of_a_magnet_are_one_site():
    axes = [ChannelSpec(name=f"{site}{axis}", kind="taxel", site=site) for site in "ab" for axis in "xyz"]
    lone, warm = ChannelSpec(name="lone", kind="taxel"), ChannelSpec(name="warm", kind="dc_temperature", site="a")
    stream = StreamSpec(name="magnets", channels=(*axes[:3], lone, *axes[3:], warm))
    pad = SensorSpec(**sensor().model_dump(exclude={"streams"}), streams=(stream,))
    sites = [[one.name for one in site] for site in pad.sites("taxel")]
    assert sites == [["ax", "ay", "az"], ["lone"], ["bx", "by", "bz"]]


@pytest.mark.parametrize("spec", [one.spec for one in REGISTRY.sensors], ids=lambda spec: spec.name)
def test_figures_of_devices_and_ranges_have_sources_and_are_not_recorded(spec):
    assert {"ranges", "data_sheet"}.isdisjoint(spec.model_dump())
    for fact in (getattr(spec.data_sheet, name) for name in OF_DEVICES):
        assert fact is None or (fact.source.tag in ("sourced", "derived", "measured") and fact.source.reference)
    stated = {"offset_scale": 1.0, **Scene(name="s").nuisances()}
    stated |= {name: one.value for name, one in spec.settable().items()}
    for name, one in {**RANGES, **spec.ranges}.items():
        assert one.lower < one.upper
        assert one.lower <= stated[name] <= one.upper, name


# Rows


def test_every_key_of_a_row_and_of_a_table_has_its_format():
    assert set(row()) | set(JSON_KEYS) | set(OF_REPLICATES) == set(FORMAT)
    assert [key for key, value in row().items() if type(value) not in FORMAT[key]] == []


def test_a_row_holds_no_number_that_is_none():
    assert RowModel(cell="a", status="done", score=0.5).score == 0.5
    for score in (float("nan"), float("inf"), "0.5"):
        with pytest.raises(ValidationError):
            RowModel(cell="a", status="done", score=score)
