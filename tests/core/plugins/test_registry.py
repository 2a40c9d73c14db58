"""What the registry makes of plugins: each is loaded alone, failures are rows, names given twice are refused."""

import fractions
import re
import sys
from importlib import metadata

import pytest

from tactbench.core.errors import DuplicateNameError, PluginError, UnknownNameError, UsageError
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.registry import Owned, Registry, installed, load_object, load_registry
from tactbench.plugin import RigDescriptor
from tactbench.plugin.simulation import ranges
from tests.core.matrix.plugin_packages import write_metadata

HEAD = """
from tactbench.plugin import *
from tactbench.plugin.devices import DeviceDescriptor
from tactbench.plugin.simulation import ranges
from tactbench.tasks.force import SPEC as FORCE
from tactbench.sensors.ideal import SPEC as IDEAL

TACTBENCH_API = 2

def sensor(name):
    stated = ranges(("taxel_white_count", 1.0, 2.0, "count", "assumed", "a test"))
    return SensorDescriptor(spec=IDEAL.model_copy(update={"name": name, "ranges": stated}))
"""
PAD = HEAD + '\n@hookimpl\ndef tactbench_sensors():\n    return [sensor("pad")]\n'
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
    return [EstimatorDescriptor(name="guess", title="a guess", kinds=("regression",), where="every:build",
                                params={"a": 1, "b": (1.5, float("inf")), "c": None, "d": "x"}, grid={"a": (1, 2.5)})]

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

    def install(self, distribution, code):
        module = distribution.replace("-", "_")
        (self.folder / f"{module}.py").write_text(code)
        write_metadata(self.folder, distribution, "2.1", points=f"{module} = {module}")
        return self

    def load(self, **limits):
        found = metadata.distributions(path=[str(self.folder)])
        return load_registry([point for one in found for point in one.entry_points], **limits)


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    yield Site(tmp_path)
    for module in ("broken_maker", "other"):
        sys.modules.pop(module, None)


def test_a_plugin_may_bring_every_kind_of_thing(site):
    hooks = {name for name in vars(hookspecs) if name.startswith("tactbench_")}
    assert hooks == {f"tactbench_{kind}" for kind in Registry().families()}
    registry = site.install("every-thing", EVERYTHING).load()
    (row,) = registry.plugins
    assert (row.status, row.reason, row.distribution, row.version) == ("loaded", "", "every-thing", "2.1")
    assert len(row.brings) == 8
    assert {"sensor pad", "profile tap"} <= {*row.brings}
    names = {kind: family.names() for kind, family in registry.families().items()}
    assert names == {
        "sensors": ["pad"], "rigs": ["press"], "devices": ["pad", "scale"], "tasks": ["push"],
        "estimators": ["guess"], "effects": [], "indenters": ["knob"], "profiles": ["tap"],
    }  # fmt: skip
    assert registry.refused == []  # a sensor and a device may share a name
    owned = registry.sensors.owned("pad")
    assert (owned.module, owned.distribution, owned.version) == ("every_thing", "every-thing", "2.1")
    stated = ranges(("taxel_white_count", 1.0, 2.0, "count", "assumed", "a test"))
    ideal = installed().sensors["ideal"].spec.model_copy(update={"name": "pad", "ranges": stated})
    assert owned.descriptor.spec == ideal, "a descriptor from a child process is the one that the plugin gave"
    guess = registry.estimators["guess"]
    assert (guess.params, guess.grid) == ({"a": 1, "b": (1.5, float("inf")), "c": None, "d": "x"}, {"a": (1, 2.5)})


BAD = {
    "raises": ("raise RuntimeError('no vendor')", "RuntimeError: no vendor"),
    "no-version": ("", "TACTBENCH_API"),
    "no-hook": (HEAD, "implements no hook of"),
    "misspelt": (HEAD + "@hookimpl\ndef tactbench_device():\n    return []", "tactbench_device"),
    "arguments": (HEAD + "@hookimpl\ndef tactbench_rigs(sensor):\n    return []", "tactbench_rigs"),
    "hook-raises": (PAD.replace("return [sensor", "1 / 0, [sensor"), r"ZeroDivisionError.*\(hook_raises.py, line \d"),
    "no-descriptor": (PAD.replace('return [sensor("pad")]', "return [IDEAL]"), "SensorSpec, not SensorDescriptor"),
    # Nothing of a plugin is used unless all of it is right.
    "another-kind": (f"{EVERYTHING}@hookimpl\ndef tactbench_effects():\n    return tactbench_rigs()", "not EffectD"),
    "of-another-version": ("TACTBENCH_API = 99\nimport nothing_such", "TACTBENCH_API = 99"),
    "aborts": ("import os; os.abort()", "signal 6"),
}


def test_a_plugin_that_fails_is_a_row_and_the_others_are_loaded(site):
    for name, (code, _) in BAD.items():
        site.install(name, code)
    registry = site.install("pad-maker", PAD).load()
    reasons = {row.distribution: row.reason for row in registry.failures}
    assert reasons.keys() == BAD.keys()
    assert {name: reasons[name] for name, (_, says) in BAD.items() if not re.search(says, reasons[name])} == {}
    assert [name for family in registry.families().values() for name in family.names()] == ["pad"]


def test_a_plugin_whose_import_never_ends_is_a_row(site):
    site.install("deaf", "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(1000)")
    (failed,) = site.load(timeout_s=1.0).failures  # alone: what ends may take longer on a busy machine
    assert "1 s" in failed.reason


def test_what_an_import_changes_changes_nothing_here(site):
    (row,) = site.install("patch", "import fractions\nfractions.Fraction = None\n" + PAD).load().plugins
    assert row.status == "loaded"
    assert fractions.Fraction(1, 2) == 0.5
    assert "patch" not in sys.modules


def test_a_package_of_mappings_needs_no_hook(site):
    (site.folder / "maps" / "datasets").mkdir(parents=True)
    (site.folder / "maps" / "__init__.py").write_text("TACTBENCH_API = 2")
    write_metadata(site.folder, "maps", "1", points="maps = maps")
    assert site.load().failures
    (site.folder / "maps" / "datasets" / "one.yaml").touch()
    assert site.load().failures == []


def test_a_name_given_twice_is_refused_naming_both_and_the_rest_is_used(site):
    more = PAD.replace('[sensor("pad")]', '[sensor("pad"), sensor("mat")]')
    registry = site.install("pad-maker", PAD).install("copycat", more).load()
    assert registry.failures == []
    assert registry.sensors.names() == ["mat"]
    with pytest.raises(DuplicateNameError, match=r"'pad'.*copycat.*pad-maker") as error:
        registry.sensors["pad"]  # it is known, and refused when it is asked for
    with pytest.raises(UnknownNameError, match=r"'mad'.*'mat'"):
        registry.sensors["mad"]
    assert [str(error.value)] == [str(refused) for refused in registry.refused]


def test_where_no_rig_is_named_one_of_ours_is_meant():
    registry = Registry()
    for name, module in (("a", "other.rigs"), ("b", "tactbench.rigs.b"), ("c", "other.rigs")):
        registry.rigs.add(Owned(RigDescriptor(name=name, title=name, where="x:y", simulated=True), module, "made", "1"))
    assert registry.first_rig("simulated") == "b"
    with pytest.raises(UsageError, match="'replays'"):
        registry.first_rig("replays")


def test_code_is_found_by_its_import_string(site):
    site.install("broken_maker", "answer = 42\nimport no_such_module_at_all").install("other", "answer = 42")
    assert load_object("other:answer") == 42
    for where in ("other:question", "no_such_module_at_all:answer", "broken_maker:answer"):
        with pytest.raises(PluginError, match=where) as error:
            load_object(where)
        assert isinstance(error.value.__cause__, ImportError | AttributeError)
