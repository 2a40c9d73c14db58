"""Names that a door is to lose: they work, with words in `tactbench plugins`, and are no error."""

import json
import sys
from types import ModuleType

import pytest

from tactbench.core.errors import PluginDeprecationWarning
from tactbench.plugin.devices import Sample
from tactbench.plugin.on_demand import Renamed, on_demand
from tests.core.plugins.test_discovery import installed_in

OLD = """
from tactbench.plugin import SensorDescriptor, hookimpl
from tactbench.plugin import on_demand
from tactbench.sensors.ideal import SPEC
import tactbench.plugin

tactbench.plugin.__getattr__ = on_demand("tactbench.plugin", {}, {"Sensor": Renamed("SensorSpec", "0.9")})
from tactbench.plugin import Sensor

TACTBENCH_API = 1

@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=Sensor.model_validate(SPEC.model_copy(update={"name": "pad"})))]
""".replace("from tactbench.plugin import on_demand", "from tactbench.plugin.on_demand import Renamed, on_demand")


@pytest.fixture
def door():
    """A door that called `New` `Old` in the last release."""
    module = ModuleType("some_door")
    module.New = object()
    module.__getattr__ = on_demand("some_door", {}, {"Old": Renamed("New", "0.3")})
    sys.modules["some_door"] = module
    yield module
    del sys.modules["some_door"]


def test_the_old_name_is_the_new_thing_and_warns_each_time(door):
    for _ in range(2):
        with pytest.warns(
            PluginDeprecationWarning, match="some_door.Old is called New now; Old is gone from .* 0.3 on"
        ):
            assert door.Old is door.New


def test_other_names_are_not_there(door):
    with pytest.raises(AttributeError, match="module 'some_door' has no attribute 'Older'"):
        _ = door.Older


def test_a_sample_of_a_driver_was_called_row():
    with pytest.warns(PluginDeprecationWarning, match="Row is called Sample now; Row is gone from tactbench 0.2 on"):
        from tactbench.plugin.devices import Row
    assert Row is Sample


def test_a_plugin_with_an_old_name_is_loaded_and_told(verbs, tmp_path):
    installed_in(tmp_path / "site", "old", OLD)
    folder = str(tmp_path / "site")
    found = json.loads(verbs("plugins", "--format", "json", plugins=(folder,)).stdout)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "old-tactile"]
    assert row["status"] == "loaded"
    assert row["remarks"] == ["tactbench.plugin.Sensor is called SensorSpec now; Sensor is gone from tactbench 0.9 on."]
    assert all(row["remarks"] == [] for row in found["plugins"] if row["distribution"] == "tactbench")
    assert "Sensor is called SensorSpec now" in verbs("plugins", plugins=(folder,)).stdout
