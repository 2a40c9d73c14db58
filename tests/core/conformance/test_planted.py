"""Mistakes that authors make, planted into a plugin of every kind: each is found by `check`, with its field or line."""

from __future__ import annotations

import pytest

from tactbench.core.conformance.run import plugins_named, run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry

PAD = '''"""A pad of four taxels."""
from tactbench.plugin import (ChannelSpec, DataSheet, PhysicalRange, SensorDescriptor, SensorSpec, Source, StreamSpec,
                              assumed, hookimpl)
from tactbench.plugin.simulation import BondedLayer, Creep, Nuisances, SkinSheet

TACTBENCH_API = 2
WHY = "its maker"
PLACES = ((-3e-3, -1.5e-3, 0.0), (-3e-3, 1.5e-3, 0.0), (2e-3, -1.5e-3, 0.0), (2e-3, 1.5e-3, 0.0))
TAXELS = tuple(
    ChannelSpec(name=f"t{n}", kind="taxel", lower=0, upper=4095, rest=assumed(100, "count", WHY), sign=1,
                position_m=place, normal=(0.0, 0.0, 1.0))
    for n, place in enumerate(PLACES, 1)
)
SKIN = BondedLayer(
    sheet=SkinSheet(x_min=assumed(-6, "mm", WHY), x_max=assumed(6, "mm", WHY), arc=assumed(12, "mm", WHY),
                    cells=(24, 24)),
    young=assumed(0.5, "MPa", WHY),
    poisson=assumed(0.3, "1", WHY),
    thickness=assumed(2, "mm", WHY),
    contact_stiffness=assumed(15, "MPa/mm", WHY),
)
SPEC = SensorSpec(
    name="NAME", title="A pad", principle="capacitive", principle_source=Source(tag="sourced", reference=WHY),
    streams=(StreamSpec(name="taxels", rate_hz=100.0, dtype="uint16", channels=TAXELS),),
    skin=SKIN,
    parameters={"gain": assumed(400, "count/MPa", WHY)},
    link_delay=assumed(2, "ms", WHY),
    nuisances={"taxel": Nuisances(white=assumed(1, "count", WHY), step=assumed(1, "count", WHY))},
)


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=SPEC, transducer="PACKAGE.code:build")]
'''
PAD_CODE = """
import numpy as np


def build(sensor, grid, wanted):
    x, s = np.meshgrid(grid.x_mm, grid.s_mm, indexing="ij")
    places = {channel.name: channel.position_m for channel in sensor.channels("taxel")}
    weights = []
    for name in wanted:
        px, py, _ = places[name]
        weight = np.exp(-((x - px * 1e3) ** 2 + (s - py * 1e3) ** 2) / 1.2**2)
        weights.append(weight / weight.sum())
    stacked = np.array(weights)
    gain = sensor.parameters["gain"].to("count/MPa")

    def transduce(state):
        return 100.0 + gain * np.tensordot(stacked, state.pressure_mpa, 2)

    return transduce
"""
TASK = '''"""Which half of the sensor was pressed."""
from tactbench.plugin import LabelTarget, Placement, PlannedScene, Scene, TaskDescriptor, TaskSpec, assumed, hookimpl

TACTBENCH_API = 2
WHY = "its maker"


def planned(role, side, mm):
    scene = Scene(name=f"{role}-{side}", placement=Placement(x=assumed(mm, "mm", WHY)), session=role,
                  labels={"side": side, "x_mm": mm})
    return PlannedScene(scene=scene, role=role)


SPEC = TaskSpec(
    name="NAME", title="Side", question="Which half was pressed?", kind="classification",
    target=LabelTarget(name="side"),
    metric="macro_f1",
    unit="1",
    scenes=tuple(planned(role, *side) for role in ("train", "test") for side in (("left", -1.0), ("right", 1.0))),
    protocols=("deployable",),
    splits=("roles", "session"),
    estimators=("logistic",),
    baselines=("majority",),
)


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=SPEC)]
'''
ESTIMATOR = '''"""Ridge regression by hand."""
from tactbench.plugin import EstimatorDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_estimators():
    return [EstimatorDescriptor(name="NAME", title="Ridge", kinds=("regression",), where="PACKAGE.code:build",
                                params={"alpha": 1.0}, grid={"alpha": (0.1, 1.0)}, rehearsal={"alpha": 1.0})]
'''
ESTIMATOR_CODE = """
import numpy as np


class Ridge:
    def __init__(self, alpha, seed):
        self.alpha = alpha

    def fit(self, X, y):
        self.middle, self.level = X.mean(axis=0), y.mean()
        Z = X - self.middle
        self.weights = np.linalg.solve(Z.T @ Z + self.alpha * np.eye(X.shape[1]), Z.T @ (y - self.level))
        return self

    def predict(self, X):
        return self.level + (X - self.middle) @ self.weights


def build(*, kind, seed, threads, alpha):
    return Ridge(alpha, seed)
"""
EFFECT = '''"""A ripple on every channel."""
from tactbench.plugin import hookimpl
from tactbench.plugin.simulation import EffectDescriptor

TACTBENCH_API = 2


@hookimpl
def tactbench_effects():
    return [EffectDescriptor(name="NAME", title="Ripple", where="PACKAGE.code:apply", produces=("disturbance",),
                             called_for="PACKAGE.code:called_for")]
'''
EFFECT_CODE = """
from tactbench.plugin.simulation import Reason


def called_for(scene, sensor):
    return Reason(False, "only by name", 0.0)


def apply(run):
    for track in run.tracks:
        track.readings += 0.01 * run.of_recording("ripple", *track.scope).standard_normal(track.readings.shape)
"""
RIG = '''"""A rig that ramps a force."""
from tactbench.plugin import RigDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_rigs():
    return [RigDescriptor(name="NAME", title="A ramp", where="PACKAGE.code:build", simulated=True)]
'''
RIG_CODE = """
from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec

FZ = ChannelSpec(name="fz", kind="force", unit="N", sign=1)
FORCE = StreamSpec(name="force_torque", rate_hz=100.0, channels=(FZ,))


class Ramp:
    plan, assumptions, drawn, reference = (), {}, {}, (FORCE,)

    def __init__(self, sensor, scene, seed):
        self.streams = tuple(stream.model_copy(update={"rate_hz": 100.0}) for stream in sensor.spec.streams)
        self.t_s = np.arange(100) / 100.0
        self.force = np.interp(self.t_s, *scene.profile.corners)
        self.rng = np.random.default_rng(seed)

    def __iter__(self):
        t_ns = np.round(self.t_s * 1e9).astype(np.int64)
        for stream in self.streams:
            rest = np.array([channel.rest.value for channel in stream.channels])
            data = np.round(rest - 10.0 * self.force[:, None] * np.linspace(0.5, 1.0, len(rest)))
            yield Block(stream.name, t_ns, data)
        yield Block("force_torque", t_ns, (self.force + self.rng.normal(0.0, 0.002, 100))[:, None])


class Rig:
    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield Ramp(sensor, scene, seed)


def build(context):
    return Rig()
"""
PLUGINS = {
    "sensor": (PAD, PAD_CODE), "task": (TASK, ""), "estimator": (ESTIMATOR, ESTIMATOR_CODE),
    "effect": (EFFECT, EFFECT_CODE), "rig": (RIG, RIG_CODE),
}  # fmt: skip

# Kind of plugin, what its author should have written, what was written, the check that finds it ("" where the plugin
# cannot even be loaded), and what the message names.
MISTAKES = [
    ("sensor", 'thickness=assumed(2, "mm", WHY)', 'thickness=assumed(2, "MPa", WHY)', "", "thickness"),
    ("sensor", 'assumed(15, "MPa/mm", WHY)', 'assumed(15, "MPa", WHY)', "", "contact_stiffness"),
    ("sensor", 'young=assumed(0.5, "MPa", WHY)', 'young=assumed(0.5, "megapascal", WHY)', "", "line 17"),
    ("sensor", 'link_delay=assumed(2, "ms", WHY)', 'link_delay=assumed(2, "mm", WHY)', "", "link_delay"),
    ("sensor", 'kind="taxel"', 'kind="taxels"', "", "kind"),
    ("sensor", 'f"t{n}"', '"t1"', "", "channel names must be unique"),
    ("sensor", "TACTBENCH_API = 2", "TACTBENCH_API = 3", "", "TACTBENCH_API"),
    ("sensor", "def tactbench_sensors", "def tactbench_sensor", "", "tactbench_sensor"),
    ("sensor", "PACKAGE.code:build", "PACKAGE.cod:build", "code-names-resolve", "transducer"),
    ("sensor", "(2e-3, 1.5e-3, 0.0)", "(2.0, 1.5, 0.0)", "positions-are-in-metres", "channels[t4].position_m"),
    ("sensor", "(2e-3, 1.5e-3, 0.0)", "(2e-2, 1.5e-3, 0.0)", "positions-are-on-the-sheet", "channels[t4].position_m"),
    ("sensor", 'dtype="uint16"', 'dtype="uint8"', "limits-fit-the-type", "channels[t1].upper"),
    ("sensor", 'white=assumed(1, "count"', 'white=assumed(1, "mV"', "nuisances-are-in-its-units", "[taxel].white"),
    ("sensor", '{"taxel": Nui', '{"dc_pressure": Nui', "nuisances-are-of-its-kinds", "nuisances[dc_pressure]"),
    ("sensor", 'rest=assumed(100, "count", WHY)', 'rest=assumed(500, "count", WHY)', "rest-is-as-stated", "t1: rest"),
    ("sensor", "sign=1", "sign=-1", "sign-is-as-stated", "t1: sign"),
    ("sensor", 'indexing="ij"', 'indexing="xy"', "response-is-where-it-is-pressed", "transducer"),
    ("sensor", "100.0 + gain", "100.0 / state.force_n + gain", "finite-at-zero-load", "code.py, line 17"),
    ("sensor", "wanted:", "sensor.channels():", "transducer-builds", "code.py, line 10"),
    ("task", 'metric="macro_f1"', 'metric="f1"', "metric-is-known", "spec.metric"),
    ("task", 'unit="1"', 'unit="mm"', "metric-has-its-unit", "spec.unit"),
    ("task", '("roles", "session")', '("leave-one-out",)', "splits-are-known", "spec.splits[0]"),
    ("task", '("deployable",)', '("karl",)', "protocols-are-known", "spec.protocols[0]"),
    ("task", 'LabelTarget(name="side")', 'LabelTarget(name="sides")', "labels-are-in-the-scenes", "train-left].labels"),
    ("task", '("logistic",)', '("ols",)', "estimators-are-installed", "spec.estimators[0]"),
    ("task", '("majority",)', '("mean",)', "baselines-are-installed", "spec.baselines[0]"),
    ("task", 'x=assumed(mm, "mm", WHY)', 'x=assumed(mm, "m", WHY)', "its-scene-is-carried-out", "scenes[train-left]"),
    ("estimator", '"alpha": 1.0}, grid', '"lambda_": 1.0}, grid', "arguments-are-taken", "params[lambda_]"),
    ("estimator", 'grid={"alpha"', 'grid={"alfa"', "arguments-are-taken", "grid[alfa]"),
    ("estimator", 'kinds=("regression",)', 'kinds=("regresion",)', "", "kinds"),
    ("estimator", "Z = X - self.middle", "X -= self.middle; Z = X", "data-is-not-changed", "fit: X"),
    ("estimator", "+ (X - self.middle) @", "+ (X - X.mean(axis=0)) @", "rows-are-answered-alone", "predict"),
    ("estimator", "return self.level + (X", "return -self.level - (X", "it-learns", "predict"),
    ("estimator", "@ self.weights", "@ self.weigths", "answers-have-the-shape", "code.py, line 16"),
    ("effect", '("disturbance",)', '("disturbence",)', "tokens-are-known", "produces[disturbence]"),
    ("effect", 'Reason(False, "only by name", 0.0)', "None", "it-says-when-it-is-called-for", "called_for"),
    ("effect", "run.tracks", "run.track", "it-is-applied", "code.py, line 10"),
    ("rig", 'unit="N"', 'unit="gf"', "force-is-recorded", "channels[fz].unit"),
    ("rig", "(self.force +", "(102.0 * self.force +", "force-follows-the-profile", "channels[fz]"),
    ("rig", "default_rng(seed)", "default_rng(0)", "other-seed-other-samples", "seed"),
    ("rig", "np.arange(100) / 100.0", "np.arange(100) / -100.0", "clocks-go-forward", "t_ns"),
    ("rig", "data = np.round(", "data = np.round(1e3 + ", "limits-are-kept", "streams[taxels]"),
    ("rig", "self.t_s * 1e9", "self.t_s * 1e6", "rates-are-as-stated", "rate_hz"),
]  # fmt: skip
SLOW = ("import-is-light",)
"""Starts an interpreter for each plugin; test_shelf.py shows that it finds what it is for."""
PLANTED = [(number, *mistake) for number, mistake in enumerate(MISTAKES, 1)]


def written(folder, number, kind, right="", wrong=""):
    """Write a plugin of a kind, named by its number, as an installer leaves it."""
    package = f"planted_{number}"
    told, code = PLUGINS[kind]
    assert not right or (told + code).count(right) >= 1, f"{right!r} is not in the plugin"
    if right:
        told, code = told.replace(right, wrong), code.replace(right, wrong)
    texts = [text.replace("PACKAGE", package).replace("NAME", f"planted-{number}") for text in (told, code)]
    (folder / package).mkdir()
    for name, text in zip(("__init__", "code"), texts, strict=True):
        (folder / package / f"{name}.py").write_text(text)
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: planted-{number}\nVersion: 1.0\nSummary: Planted\n")
    (info / "entry_points.txt").write_text(f"[tactbench]\nplanted-{number} = {package}\n")


@pytest.fixture(scope="module")
def registry(tmp_path_factory):
    """All of them, and one of each kind without a mistake, installed side by side."""
    folder = tmp_path_factory.mktemp("site")
    for number, kind, right, wrong, _, _ in PLANTED:
        written(folder, number, kind, right, wrong)
    for kind in PLUGINS:
        written(folder, kind, kind)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield load_registry()


@pytest.mark.parametrize("kind", PLUGINS)
def test_without_a_mistake_it_passes(registry, kind):
    (subject,) = subjects_named(registry, f"planted-{kind}")
    report = run_checks(subject, isolated=False, without=SLOW)
    assert report.ok, str(report)
    assert report.level == "silver"


@pytest.mark.parametrize(
    ("number", "kind", "right", "wrong", "check", "names"), PLANTED, ids=[f"{row[1]}-{row[5]}" for row in PLANTED]
)
def test_a_mistake_is_found_and_its_place_named(registry, number, kind, right, wrong, check, names):
    name = f"planted-{number}"
    if not check:
        (row,) = plugins_named(registry, name)
        assert row.status == "failed"
        assert names in row.reason
        assert subjects_named(registry, name) == []
        return
    (subject,) = subjects_named(registry, name)
    failed = run_checks(subject, isolated=False, without=SLOW).failed
    assert check in [one.check for one in failed], [str(one) for one in failed]
    assert names in next(f"{one.where}: {one.text}" for one in failed if one.check == check)


def test_there_are_thirty_over_all_kinds():
    assert len(PLANTED) >= 30
    assert {kind for _, kind, *_ in PLANTED} == set(PLUGINS)
