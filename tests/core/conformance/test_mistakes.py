"""Mistakes that makers make, one in each copy of a sound plugin: found by `check`, with the field, line or words."""

from __future__ import annotations

import pytest

from tactbench.core.conformance.check import CHECKS
from tactbench.core.conformance.run import plugins_named, run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry
from tests.conftest import THIRD_PARTY

SHELF = THIRD_PARTY / "flawed"
SOUND = ("axis", "rig", "task", "force", "profile")  # the others are among those of the makers
PACKAGE = {"pad": "devices", "scale": "devices", "stage": "devices", "axis": "devices", "rig": "rigs"}
KIND = {
    "pad": "sensor", "scale": "device", "stage": "device", "axis": "device", "rig": "rig",
    "task": "task", "force": "task", "estimator": "estimator",
    "effect": "effect", "shape": "indenter", "profile": "profile",
}  # fmt: skip
PLACE, WORLD = "(2e-3, 1.5e-3, 0.0)", "super().read(timeout_s)"
CAUGHT = """    def caught(self, timeout_s):
        try:
            return super().read(timeout_s)
        except Exception:
            return []

    def quiet"""
TWICE = """            self._numbers.append(data[1])
            yield self.sample([self.scale * value for value in values])
"""
STAMPED = "sequence=self._unwrap(self._numbers))"
# What is flawed, what its author should have written, what was written, the check that finds it ("" where the plugin
# cannot even be loaded), and words of the message.
MISTAKES = [
    ("pad", 'thickness=assumed(2, "mm", WHY)', 'thickness=assumed(2, "MPa", WHY)', "", "thickness"),
    ("pad", "TACTBENCH_API = 2", "TACTBENCH_API = 99", "", "TACTBENCH_API"),
    ("pad", "def tactbench_sensors", "def tactbench_sensor", "", "tactbench_sensor"),
    ("pad", "transduction:build", "transducer:build", "code-names-resolve", "transducer"),
    ("pad", '"""A pad of', 'import h5py\n"""A pad of', "import-is-light", "h5py"),
    ("pad", "upper=2047, ", "", "limits-are-in-order", "channels[t1].lower, upper"),
    ("pad", "lower=-2048", "lower=200", "limits-are-in-order", "channels[t1].rest"),
    ("pad", 'kind="taxel"', 'kind="force", unit="m"', "limits-are-in-order", "measured in N"),
    ("pad", "rate_hz=100.0", "rate_hz=0.01", "limits-are-in-order", "rate_hz"),
    ("pad", PLACE, "(2.0, 1.5, 0.0)", "places-are-on-the-skin", "position_m"),
    ("pad", PLACE, "(2e-3, -1.5e-3, 0.0)", "places-are-on-the-skin", "t3"),
    ("pad", "normal=(0.0, 0.0, 1.0)", "normal=(0.0, 1.0, 1.0)", "places-are-on-the-skin", "1.414"),
    ("pad", 'white=assumed(1, "count"', 'white=assumed(1, "mV"', "nuisances-are-in-its-units", "[taxel].white"),
    ("pad", '{"taxel": Nui', '{"dc_pressure": Nui', "nuisances-are-in-its-units", "there are taxel"),
    ("pad", 'rest=assumed(100, "count", WHY)', 'rest=assumed(500, "count", WHY)', "rest-is-as-stated", "t1: rest"),
    ("pad", "sign=1", "sign=-1", "press-is-recorded", "[t1].sign"),
    ("pad", "100.0 + gain", "100.0 / state.force_n + gain", "transducer-reads", "line 18): ZeroDivisionError"),
    ("pad", "state.pressure_mpa, 2)", "np.log(1.5 - state.depth_mm) * state.pressure_mpa, 2)", "transducer-reads",
     "100 N"),
    ("pad", "in channel_names", "in channel_names[1:]", "transducer-reads", "(3,)"),
    ("pad", "state.pressure_mpa, 2", "state.shear_mpa[0], 2", "transducer-reads", "line 18"),
    ("pad", "reads_shear=()", 'reads_shear=("taxel",)', "shear-turns-with-its-direction", "reads_shear"),
    ("pad", "return 100.0", "state.pressure_mpa[:] *= 2; return 100.0", "transducer-reads", "read-only"),
    ("pad", "return 100.0", "return 100.0 + np.random.rand(len(stacked))", "transducer-reads", "in another order"),
    ("pad", "assumed(400,", "assumed(0.4,", "it-answers-to-a-press", "0.0279"),
    ("pad", "assumed(400,", "assumed(4e6,", "press-is-recorded", "force_range"),
    ("pad", "state.pressure_mpa, 2)", "state.pressure_mpa, 2) / (1 + 3 * state.force_n**2)",
     "it-answers-to-a-press", "2 N"),
    ("pad", STAMPED, STAMPED[:-1] + ", t_ns=block.t_ns / 1e9)", "driver-reads", "seconds"),
    ("pad", STAMPED, STAMPED[:-1] + ", t_ns=block.t_ns - block.t_ns[0])", "driver-reads", "device_ns"),
    ("pad", ("scale = 100.0", "            yield self"), ("scale = 50.0", TWICE + "            yield self"),
     "driver-reads", "repeat the previous row with a new time"),
    ("pad", "self._left = data\n", "self._left = b''\n", "driver-takes-any-pieces", "in pieces"),
    ("pad", "or sum(data[: size - 1]) % 256 != data[size - 1]", "", "driver-takes-any-pieces", "without 5 of its"),
    ("pad", "self.counted[", "{'bytes of no frame': 0}[", "driver-takes-any-pieces", "neither counted in"),
    ("pad", "data = data[1:]\n", "raise ValueError(data[:1])\n", "driver-takes-any-pieces", "line.py, line"),
    ("pad", "self._unwrap(self._numbers)", "np.array(self._numbers)", "driver-counts-on", "255 is followed by row 0"),
    ("pad", "[self.scale * value", "[abs(self.scale * value)", "driver-reads-what-is-sensed", "sign reversed?"),
    ("pad", "in values])", "in values[::-1]])", "driver-reads-what-is-sensed", "which is the reading of t4"),
    ("pad", 'f"<{len(self.stream.channels)}{self.layout}", data', 'f">{len(self.stream.channels)}{self.layout}", data',
     "driver-reads-what-is-sensed", "taxels.t1"),
    ("pad", ('f"<{len(self.stream.channels)}{self.layout}", data', 'f"<BB{len(whole)}{self.layout}", MARK'),
     ('f">{len(self.stream.channels)}{self.layout}", data', 'f">BB{len(whole)}{self.layout}", MARK'),
     "driver-decodes-the-manual", "expected 300 by the manual, the driver reads 11265"),
    ("pad", "def begin(self)", "def start(self)", "driver-reports-what-happens", "before start()"),
    ("pad", WORLD, "super().read(0.5)", "driver-waits-and-stops", "read(0) took"),
    ("pad", (WORLD, "    def quiet"), ("self.caught(timeout_s)", CAUGHT), "driver-reports-what-happens", "unplugged"),
    ("pad", 'link_kind, layout',
     'options_kind = __import__("pydantic").create_model("Any", no_such_option=(int, 0))\n    link_kind, layout',
     "driver-opens", "no_such_option"),
    ("pad", '{"model": "framed"}', '{"serial": 7}', "driver-opens", "names and texts"),
    ("scale", 'unit="N"', 'unit="mN"', "device-is-fit-for-a-rig", "fx.unit"),
    ("scale", '"i", 1e-3\n\n    def sample', '"i", 0.101972\n\n    def sample', "driver-reads-what-is-sensed",
     "are these gram-force?"),
    ("scale", '"i", 1e-3\n\n    def sample', '"i", 1.0\n\n    def sample', "driver-reads-what-is-sensed",
     "are these millinewtons?"),
    ("scale", "Quality.SATURATED,", "Quality.GOOD,", "device-is-fit-for-a-rig", "not marked SATURATED"),
    ("stage", 'unit="m"', 'unit="mm"', "device-is-fit-for-a-rig", "position.unit"),
    ("stage", 'self.link.write(b"go")', 'self.link.write(b"run"); self.link.write(b"go")',
     "device-is-fit-for-a-rig", "without a move"),
    ("axis", '(b"S\\n")', '(b"?\\n")', "axis-halts-and-retreats", "still moves"),
    ("axis", "self.check_move(position)", "pass", "axis-is-homed", "before the axis is homed"),
    ("axis", "self.check_move(position)", "self.enabled = self.enabled or self.check_move(position)",
     "axis-goes-where-it-is-sent", "during another move"),
    ("axis", "self.check_move(position)", "self.check_move(max(-4e-3, min(4e-3, position)))",
     "axis-goes-where-it-is-sent", "m beyond the ends of travel"),
    ("axis", ("round(1e6 * (position", "1e-6 * int(steps), idle", "+ 1e-6 * steps"),
     ("-round(1e6 * (position", "-1e-6 * int(steps), idle", "- 1e-6 * steps"), "axis-goes-where-it-is-sent",
     "direction reversed?"),
    ("axis", "round(1e6 * (position", "round(39.37e3 * (position", "axis-goes-where-it-is-sent", ", expected "),
    ("axis", "stop_latency_s = 0.06", "stop_latency_s = 0.01", "axis-halts-and-retreats", "still moves"),
    ("axis", "        self.finish(stop)\n", "", "axis-is-homed", "driver.home"),
    ("axis", "stop_latency_s = 0.06", "stop_latency_s = float('nan')", "axis-is-homed", "both ends of travel"),
    ("axis", "    def update(", "    def retreat(self):\n        self.halt()\n\n    def update(",
     "axis-halts-and-retreats", "driver.retreat: the axis is"),
    ("rig", 'unit="N"', 'unit="gf"', "press-is-recorded", "reference"),
    ("rig", "(self.force +", "(-self.force +", "press-is-recorded", "sign"),
    ("rig", "default_rng(seed)", "default_rng(0)", "force-and-seed-decide", "two seeds"),
    ("rig", "default_rng(seed)", "default_rng()", "force-and-seed-decide", "the same seed"),
    ("rig", "t_ns, data)", "t_ns[::-1].copy(), data)", "press-is-recorded", "backwards"),
    ("rig", "self.t_s * 1e9", "self.t_s * 1e3", "press-is-recorded", "milliseconds"),
    ("rig", '{"rate_hz": 100.0}', '{"rate_hz": 200.0}', "press-is-recorded", "200 Hz is stated"),
    ("rig", "t_ns, data)", "t_ns, data[:, 1:])", "press-is-recorded", "of shape (100, 11)"),
    ("task", 'metric="macro_f1"', 'metric="rmse"', "metric-has-its-unit", "is for regression"),
    ("task", '("roles", "session")', '("leave-one-out",)', "names-are-known", "spec.splits"),
    ("task", '("logistic",)', '("ols",)', "names-are-known", "spec.estimators"),
    ("task", 'LabelTarget(name="side")', 'LabelTarget(name="sides")', "answers-are-in-the-scenes", "there is side"),
    ("task", 'x=assumed(mm, "mm", WHY)', 'x=assumed(mm, "m", WHY)', "scenes-can-be-pressed", "scenes[train-left]"),
    ("task", 'name=f"{role}-{side}"', "name=role", "answers-are-in-the-scenes", "two scenes have this name"),
    ("task", 'labels={"side": side', 'labels={"side": f"{side} {role}"', "answers-are-in-the-scenes", "right test"),
    ("task", 'observe=("taxel",)', 'observe=("ac_pressure",)', "answers-are-in-the-scenes", "observe"),
    ("force", "ChannelTarget()", 'ChannelTarget(name="shear")', "scenes-can-be-pressed", "recorded: fz"),
    ("estimator", "(40, 60)", "(40.0, 60)", "answers-have-the-shape", "grid[rows] = 40.0"),
    ("estimator", "Z = (X", "X -= self.middle; Z = (X", "answers-have-the-shape", "read-only"),
    ("estimator", "np.where(spread > 0, spread, 1.0)", "spread", "answers-have-the-shape", "predict"),
    ("estimator", "X.mean(axis=0), y.mean()", "X.mean(axis=0), (KEPT.append(y.mean()), sum(KEPT))[1]",
     "seed-and-data-decide", "answer differently"),
    ("effect", '("disturbance",)', '("disturbence",)', "effect-takes-part", "disturbance"),
    ("shape", "(2 * size)", "(2 * size) + 0.1", "indenter-is-pressed", "0.1 mm at (0, 0)"),
    ("profile", "(0, 0, peak)", "(1, 1, peak)", "path-is-recorded", "the path starts at 1 N"),
    ("profile", "(0, 0, peak)", "(0, 0, 102 * peak)", "path-is-recorded", "are these gram-force?"),
]  # fmt: skip
PLANTED = [(number, *mistake) for number, mistake in enumerate(MISTAKES, 1)]


def written(folder, number, name, right, wrong):
    """Write a copy of a sound package with one mistake, named by its number, as an installer leaves it."""
    old, new = f"sound_{PACKAGE.get(name, 'others')}", f"planted{number}_{PACKAGE.get(name, 'others')}"
    texts = {path.name: path.read_text() for path in (SHELF / old).glob("*.py")}
    pairs = [(right, wrong)] if isinstance(right, str) else list(zip(right, wrong, strict=True))
    for one, _ in pairs:
        assert any(one in text for text in texts.values()), f"{one!r} is not in {old}"
    (folder / new).mkdir()
    for file, text in texts.items():
        for one, other in pairs:
            text = text.replace(one, other)
        changed = text.replace("sound_", f"planted{number}_")
        (folder / new / file).write_text(changed.replace("sound-", f"planted{number}-"))
    info = folder / f"{new}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {new}\nVersion: 1.0\nSummary: Planted\n")
    (info / "entry_points.txt").write_text(f"[tactbench]\nplanted-{number} = {new}\n")


@pytest.fixture(scope="module")
def registry(tmp_path_factory):
    """All of them and the sound ones, installed side by side."""
    folder = tmp_path_factory.mktemp("site")
    for number, name, right, wrong, _, _ in PLANTED:
        written(folder, number, name, right, wrong)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.syspath_prepend(SHELF)
        yield load_registry()


def all_but(check):
    """Return the names of all checks but one and those that it needs: the others take time and show nothing here."""
    wanted, needs = [check], {one.name: one.needs for one in CHECKS}
    for name in wanted:
        wanted += needs[name]
    return {one.name for one in CHECKS} - set(wanted)


def report_of(registry, kind, name, without=()):
    (subject,) = subjects_named(registry, name, (kind,))
    return run_checks(subject, isolated=False, without=without)


@pytest.mark.parametrize("name", SOUND)
def test_without_a_mistake_it_passes(registry, name):
    report = report_of(registry, KIND[name], f"sound-{name}")
    assert report.ok, str(report)
    assert report.level == "silver"


@pytest.mark.parametrize(
    ("number", "name", "right", "wrong", "check", "words"),
    PLANTED,
    ids=[f"{row[1]}-{row[4]}-{row[0]}" for row in PLANTED],
)
def test_a_mistake_is_found_and_named(registry, number, name, right, wrong, check, words):
    if not check:
        (row,) = plugins_named(registry, f"planted-{number}")
        assert row.status == "failed"
        assert words in row.reason
        return
    report = report_of(registry, KIND[name], f"planted{number}-{name}", all_but(check))
    found = {one.check: f"{one.where}: {one.text}" for one in report.failed}
    assert words in found.get(check, ""), str(report)
    assert report.level is None
