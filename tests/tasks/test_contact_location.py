"""Where on the skin it touches, asked of presses of the twin at scattered places."""

import time

import numpy as np
import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.evaluation.protocols import protocol_called
from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tactbench.plugin import Placement, RigContext, assumed
from tactbench.plugin.simulation import Slide
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.rig import build
from tactbench.tasks import contact_location, three_axis_force
from tactbench.tasks.contact_location import LOCATION_SCENES, REACH_MM

SENSORS = ["biotac", "icub"]


def pressed(sensor, folder, planned):
    rig, registry, paths = build(RigContext(effects=tuple(tactbench_effects()))), installed(), []
    for item in planned:
        paths.append(folder / f"{item.scene.name}.h5")
        acquire(
            rig, registry.sensors[sensor], registry.rigs["twin"], item.scene, role=item.role, seed=1, path=paths[-1],
            clock=time.perf_counter, provenance={},
        )  # fmt: skip
    return paths


@pytest.fixture(scope="module", params=SENSORS)
def recorded(request, tmp_path_factory):
    """Two training sessions and two test sessions: a third of the campaign."""
    planned = [item for item in LOCATION_SCENES if item.scene.session in ("train-1", "train-2", "test-1", "test-2")]
    return pressed(request.param, tmp_path_factory.mktemp(request.param), planned)


def run(paths, estimator):
    return evaluate_cell(
        CellContext(
            contact_location.SPEC, installed().estimators[estimator], {}, "deployable", "roles", seed=1,
            clock=time.perf_counter, latency=False,
        ),
        paths,
    )  # fmt: skip


def test_the_place_is_found_on_both_sensors(recorded):
    """From 20 places on a square of 10 mm, two millimetres apart: half of that is within reach, chance is 3.8 mm."""
    result, mean = run(recorded, "forest-10"), run(recorded, "mean")
    assert mean.score > 3.0
    assert result.scores["median error"] < 1.5
    assert result.score < mean.score / 2


def test_the_reference_is_where_the_indenter_was_put(recorded):
    for path in recorded[:3]:
        with open_recording(path) as recording:
            place = recording.read("contact_point")
            drawn, hold = recording.meta.drawn, recording.meta.scene.profile.hold.to("s")
            force_n = recording.read("force_torque").data
        missing = np.asarray(place.quality) & Quality.MISSING
        pressing = 1e-9 * (place.t_ns - place.t_ns[0]) > hold
        np.testing.assert_array_equal(missing[:, 0] == 0, pressing)
        np.testing.assert_allclose(1e3 * place.data[pressing, 0], drawn["placed_x_mm"], rtol=1e-12)
        np.testing.assert_allclose(1e3 * place.data[pressing, 1], drawn["placed_s_mm"], rtol=1e-12)
        assert len(force_n) == len(place.data)


def test_no_other_recording_has_the_place(tmp_path):
    scene = LOCATION_SCENES[0].scene.model_copy(update={"observe": ("taxel",)})
    with_place, without = (
        build(RigContext(effects=tuple(tactbench_effects()))).open(installed().sensors["icub"], one, seed=1)
        for one in (LOCATION_SCENES[0].scene, scene)
    )
    with with_place as first, without as second:
        assert [stream.name for stream in first.reference] == ["force_torque", "contact_point"]
        assert [stream.name for stream in second.reference] == ["force_torque"]
        for name, samples in second.samples.items():
            np.testing.assert_array_equal(samples.data, first.samples[name].data)


def test_a_slide_has_no_place():
    scene = LOCATION_SCENES[0].scene.model_copy(update={"slide": Slide(speed=assumed(5.0, "mm/s", "a test"))})
    rig = build(RigContext(effects=tuple(tactbench_effects())))
    with (
        pytest.raises(NotApplicable, match="does not move the contact"),
        rig.open(installed().sensors["icub"], scene, seed=1),
    ):
        pass


def test_the_places_are_scattered_evenly_and_none_is_shared():
    placed = {
        role: np.array(
            [[item.scene.placement.x.to("mm"), item.scene.placement.s.to("mm")]
             for item in LOCATION_SCENES if item.role == role]
        )
        for role in ("train", "validation", "test")
    }  # fmt: skip
    every = np.concatenate(list(placed.values()))
    assert len({tuple(one) for one in every.tolist()}) == len(every) == len({i.scene.name for i in LOCATION_SCENES})
    for where in placed.values():
        assert np.abs(where).max() < REACH_MM
        quadrants = np.unique(where > 0, axis=0, return_counts=True)[1]
        assert len(quadrants) == 4
        assert quadrants.min() >= 0.15 * len(where), "a quarter each, within what few points allow"


@pytest.mark.parametrize("sensor", SENSORS)
def test_no_place_is_beyond_what_the_twin_answers_for(sensor):
    corners = [(sign_x * REACH_MM, sign_s * REACH_MM) for sign_x in (-1, 1) for sign_s in (-1, 1)]
    rig = build(RigContext(effects=tuple(tactbench_effects())))
    for x, s in corners:
        place = Placement(x=assumed(x, "mm", "a corner"), s=assumed(s, "mm", "a corner"))
        scene = LOCATION_SCENES[0].scene.model_copy(update={"placement": place})
        with rig.open(installed().sensors[sensor], scene, seed=1) as acquisition:
            blocks = list(acquisition)
        assert not [name for name in acquisition.drawn if name.startswith("remark")]
        taxels = [block for block in blocks if block.stream not in ("force_torque", "contact_point")]
        assert not any(block.quality is not None and (block.quality & Quality.SATURATED).any() for block in taxels)


@pytest.mark.parametrize("spec", [contact_location.SPEC, three_axis_force.SPEC], ids=lambda spec: spec.name)
def test_the_tasks_name_what_there_is(spec):
    """Their entry points take effect with an installation; their names must be right before."""
    registry = installed()
    for name in (*spec.estimators, *spec.baselines):
        assert "regression" in registry.estimators[name].kinds
    assert all(protocol_called(name).name == name for name in spec.protocols)
    assert set(spec.splits) <= {*SPLITS_WITHOUT_GROUPS, "roles", "session", "recording", "press"}
    assert not three_axis_force.SPEC.scenes, "taxels of the twin do not answer to shear"
