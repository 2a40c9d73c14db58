"""What the registry makes of plugins: each is loaded alone, failures are rows, names given twice are refused."""

from __future__ import annotations

import fractions
import re
import sys
from importlib import metadata
from importlib.metadata import EntryPoint

import pytest

from tactbench.core.errors import DuplicateNameError, PluginError, UnknownNameError
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.registry import Registry, installed, load_object, load_registry
from tactbench.plugin import SensorDescriptor
from tactbench.plugin.devices import DeviceDescriptor
from tactbench.sensors.ideal import SPEC as IDEAL

HEAD = """
from tactbench.plugin import *
from tactbench.plugin.devices import DeviceDescriptor
from tactbench.plugin.simulation import EffectDescriptor
from tactbench.plugin import hookimpl
from tactbench.tasks.force import SPEC as FORCE
from tactbench.sensors.ideal import SPEC as IDEAL

TACTBENCH_API = 1

def sensor(name):
    return SensorDescriptor(spec=IDEAL.model_copy(update={"name": name}))
"""
PAD = (
    HEAD
    + """
@hookimpl
def tactbench_sensors():
    return [sensor("pad")]
"""
)
EVERYTHING = (
    HEAD
    + """
@hookimpl
def tactbench_sensors():
    yield sensor("pad")

@hookimpl
def tactbench_rigs():
    return (RigDescriptor(name="press", title="a press", where="every:build"),)

@hookimpl
def tactbench_devices():
    return [
        DeviceDescriptor(name="scale", title="a scale", kind="force", driver="every:build"),
        DeviceDescriptor(name="pad", title="a motor", kind="motor", driver="every:build"),
    ]

@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=FORCE.model_copy(update={"name": "push"}))]

@hookimpl
def tactbench_estimators():
    return [EstimatorDescriptor(name="guess", title="a guess", kinds=("regression",), where="every:build")]

@hookimpl
def tactbench_effects():
    return []

@hookimpl
def tactbench_indenters():
    size = Parameter(default=1.0, unit="mm", text="its size")
    return [IndenterDescriptor(name="knob", title="a knob", where="every:build", dimensions={"size": size})]

@hookimpl
def tactbench_profiles():
    return [ProfileDescriptor(name="tap", title="a tap", where="every:build")]
"""
)


class Site:
    """A folder of distributions as an installer leaves them."""

    def __init__(self, folder):
        self.folder = folder
        self.modules = []

    def install(self, distribution, code, *, module=None, version="1.0", name=None):
        module = module or distribution.replace("-", "_")
        (self.folder / f"{module}.py").write_text(code)
        info = self.folder / f"{module}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
        (info / "entry_points.txt").write_text(f"[tactbench]\n{name or module} = {module}\n")
        self.modules.append(module)
        return self

    def points(self):
        found = metadata.distributions(path=[str(self.folder)])
        return [point for one in found for point in one.entry_points if point.group == "tactbench"]

    def load(self):
        return load_registry(self.points())


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    made = Site(tmp_path)
    yield made
    for module in made.modules:
        sys.modules.pop(module, None)


def test_there_is_a_hook_for_each_kind_and_no_other():
    hooks = {name for name in vars(hookspecs) if name.startswith("tactbench_")}
    assert hooks == {f"tactbench_{kind}" for kind in Registry().families()}


def test_a_plugin_may_bring_every_kind_of_thing(site):
    registry = site.install("every", EVERYTHING, version="2.1").load()
    (row,) = registry.plugins
    assert (row.status, row.reason, row.distribution, row.version) == ("loaded", "", "every", "2.1")
    assert set(row.brings) == {
        "sensor pad", "rig press", "device scale", "device pad", "task push", "estimator guess",
        "indenter knob", "profile tap",
    }  # fmt: skip
    names = {kind: family.names() for kind, family in registry.families().items()}
    assert names == {
        "sensors": ["pad"], "rigs": ["press"], "devices": ["pad", "scale"], "tasks": ["push"],
        "estimators": ["guess"], "effects": [], "indenters": ["knob"], "profiles": ["tap"],
    }  # fmt: skip
    assert registry.refused == []  # a sensor and a device may share a name
    assert isinstance(registry.devices["scale"], DeviceDescriptor)
    assert [device.name for device in registry.devices] == ["pad", "scale"]


def test_a_descriptor_knows_who_brought_it(site):
    owned = site.install("pad-maker", PAD, version="0.3").load().sensors.owned("pad")
    assert (owned.descriptor.name, owned.module, owned.distribution, owned.version) == (
        "pad", "pad_maker", "pad-maker", "0.3",
    )  # fmt: skip


BAD = {
    "raises": ("raise RuntimeError('no vendor library')", "RuntimeError: no vendor library"),
    "exits": ("raise SystemExit('good bye')", "SystemExit: good bye"),
    "misses an import": ("import no_such_module_at_all", "ModuleNotFoundError.*no_such_module_at_all"),
    "does not parse": ("def f(:", "SyntaxError"),
    "states no version": ("", "states no TACTBENCH_API; this tactbench speaks 1. Write TACTBENCH_API = 1"),
    "is of a later version": ("TACTBENCH_API = 2", "TACTBENCH_API = 2, a later version .* speaks, 1. Update tactbench"),
    "is of an earlier version": ("TACTBENCH_API = 0", "= 0, which is no longer spoken; .* speaks 1. Update the plugin"),
    "states no number": ("TACTBENCH_API = True", "states TACTBENCH_API = True, which is no whole number"),
    "has no hook": (HEAD, "implements none of tactbench_devices, tactbench_effects"),
    "misspells its hook": (
        HEAD + "@hookimpl\ndef tactbench_device():\n    return []",
        "unknown hook.*tactbench_device",
    ),
    "asks its hook for arguments": (HEAD + "@hookimpl\ndef tactbench_rigs(sensor):\n    return []", "tactbench_rigs"),
    "raises in its hook": (PAD.replace("return [sensor", "1 / 0, [sensor"), "ZeroDivisionError"),
    "returns nothing": (PAD.replace('return [sensor("pad")]', "pass"), "tactbench_sensors of bad returned None"),
    "returns no descriptor": (PAD.replace('return [sensor("pad")]', "return [IDEAL]"), "returned SensorSpec, not Sens"),
    "returns another kind": (
        EVERYTHING + "\n@hookimpl\ndef tactbench_effects():\n    return tactbench_rigs()",
        "tactbench_effects of bad returned RigDescriptor, not EffectDescriptor",
    ),
}


@pytest.mark.parametrize("code", BAD)
def test_a_plugin_that_fails_is_a_row_and_the_others_are_loaded(site, code):
    text, reason = BAD[code]
    registry = site.install("bad", text).install("pad-maker", PAD).load()
    assert {row.distribution: row.status for row in registry.plugins} == {"bad": "failed", "pad-maker": "loaded"}
    (failed,) = registry.failures
    assert failed.brings == ()
    assert failed.reason
    assert re.search(reason, failed.reason), failed.reason
    # Nothing of a plugin is used unless all of it is right.
    assert [len(family.names()) for family in registry.families().values()] == [1, 0, 0, 0, 0, 0, 0, 0]


ENDS = {
    "exits at once": ("import os; os._exit(0)", "exit code 0"),
    "pretends that the user has pressed Ctrl-C": ("raise KeyboardInterrupt", "KeyboardInterrupt"),
    "aborts": ("import os; os.abort()", "signal 6"),
    "kills its group": ("import os; os.killpg(0, 9)", "signal 9"),
    "closes what is not its own": ("import os; os.closerange(3, 64)", "gave no"),
}


def test_a_plugin_whose_import_ends_its_process_is_a_row(site):
    for name, (code, _) in ENDS.items():
        site.install(name.split()[0], code)
    registry = site.install("pad-maker", PAD).load()
    reasons = {row.distribution: row.reason for row in registry.failures}
    assert {name: reasons[name.split()[0]] for name in ENDS} == {
        name: reasons[name.split()[0]] for name, (_, says) in ENDS.items() if says in reasons[name.split()[0]]
    }
    assert registry.sensors.names() == ["pad"]


def test_a_plugin_whose_import_never_ends_is_a_row(site):
    site.install("loops", "while True: pass")
    site.install("deaf", "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(1000)")
    registry = load_registry(site.points(), timeout_s=1.0)  # alone: what ends may take longer on a busy machine
    assert [row.distribution for row in registry.failures] == ["deaf", "loops"]
    assert all("longer than 1 s" in row.reason for row in registry.failures)


def test_what_an_import_changes_changes_nothing_here(site):
    patches = "import fractions\nfractions.Fraction = None\n" + PAD
    (row,) = site.install("patch", patches).load().plugins
    assert row.status == "loaded"
    assert fractions.Fraction(1, 2) == 0.5
    assert "patch" not in sys.modules


def test_a_descriptor_from_a_child_process_is_the_one_that_the_plugin_gave(site):
    code = PAD.replace('return [sensor("pad")]', "return [SensorDescriptor(spec=IDEAL)]")
    code += """
@hookimpl
def tactbench_estimators():
    return [EstimatorDescriptor(name="guess", title="a guess", kinds=("regression",), where="every:build",
                                params={"a": 1, "b": (1.5, float("inf")), "c": None, "d": "x"}, grid={"a": (1, 2.5)})]
"""
    registry = site.install("pad-maker", code).load()
    assert registry.sensors["ideal"] == SensorDescriptor(spec=IDEAL)
    guess = registry.estimators["guess"]
    assert guess.params == {"a": 1, "b": (1.5, float("inf")), "c": None, "d": "x"}
    assert guess.grid == {"a": (1, 2.5)}


def test_a_name_given_twice_is_refused_naming_both_and_the_rest_is_used(site):
    more = PAD.replace('[sensor("pad")]', '[sensor("pad"), sensor("mat")]')
    registry = site.install("pad-maker", PAD).install("copycat", more).load()
    assert registry.failures == []
    (refused,) = registry.refused
    assert registry.sensors.names() == ["mat"]
    assert [sensor.name for sensor in registry.sensors] == ["mat"]
    assert "pad" in registry.sensors  # it is known, and refused when it is asked for
    with pytest.raises(
        DuplicateNameError, match=r"sensor 'pad'.*copycat \(copycat\) and pad-maker \(pad_maker\)"
    ) as error:
        registry.sensors["pad"]
    assert str(error.value) == str(refused)
    assert error.value.hint


def test_a_device_named_twice_is_refused_as_well(site):
    scales = EVERYTHING.replace('"pad", title="a motor", kind="motor"', '"scale", title="another", kind="force"')
    (refused,) = site.install("every", scales).load().refused
    assert "device 'scale' is defined by every (every) and every (every)" in str(refused)


def test_an_entry_point_found_twice_counts_once(site):
    site.install("pad-maker", PAD)
    registry = load_registry(site.points() * 2)
    assert len(registry.plugins) == 1
    assert registry.refused == []


def test_rows_stand_in_the_order_of_entry_points(site):
    site.install("b", PAD, name="second").install("a", PAD.replace('"pad"', '"mat"'), name="third")
    site.install("c", "raise OSError", name="first")
    for points in (site.points(), site.points()[::-1]):
        assert [row.entry_point for row in load_registry(points).plugins] == ["first", "second", "third"]


def test_an_unknown_name_comes_with_those_that_are_known(site):
    registry = site.install("every", EVERYTHING).load()
    with pytest.raises(UnknownNameError, match="no device called 'scael'") as error:
        registry.devices["scael"]
    assert error.value.hint == "Did you mean 'scale'? Known: pad, scale."
    with pytest.raises(UnknownNameError) as error:
        registry.effects["creep"]
    assert error.value.hint == "No effect is installed."


def test_an_entry_point_of_no_distribution_has_an_unknown_owner(site):
    site.install("pad-maker", PAD)
    (row,) = load_registry([EntryPoint("pad", "pad_maker", "tactbench")]).plugins
    assert (row.status, row.distribution, row.version) == ("loaded", "unknown", "")


def test_what_is_installed_is_loaded_once_a_process():
    assert installed() is installed()
    assert installed().failures == []
    assert installed().refused == []


def test_code_is_found_by_its_import_string(site):
    site.install("maker", "answer = 42\nimport no_such_module_at_all", module="broken_maker")
    site.install("other", "answer = 42")
    assert load_object("other:answer") == 42
    for where in ("other:question", "no_such_module_at_all:answer", "broken_maker:answer"):
        with pytest.raises(PluginError, match=f"{where} cannot be loaded") as error:
            load_object(where)
        assert isinstance(error.value.__cause__, ImportError | AttributeError)
        assert "tactbench plugins" in error.value.hint
