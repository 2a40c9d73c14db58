"""What the documentation and the examples show is what the model reads."""

import re

import pytest
from pydantic import BaseModel

from tactbench.core.recording.mapping import model
from tactbench.core.recording.mapping.channels import sensor_of
from tactbench.core.spec.task import DeclaredTask
from tactbench.core.spec.yaml_file import load_yaml
from tests.conftest import ROOT

PAGE = (ROOT / "docs" / "mappings.md").read_text(encoding="utf-8")


def test_the_blocks_of_the_page_make_one_mapping(tmp_path):
    blocks = re.findall(r"^```yaml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    path = tmp_path / "mapping.yaml"
    path.write_text("".join(blocks), encoding="utf-8")
    sensor, *_ = sensor_of(load_yaml(path, model.Mapping))
    assert [channel.name for channel in sensor.channels()][:4] == ["m1x", "m1y", "m1z", "m2x"]


@pytest.mark.parametrize("path", sorted((ROOT / "examples" / "mappings").glob("*.yaml")), ids=lambda path: path.stem)
def test_an_example(path):
    mapping = load_yaml(path, model.Mapping)
    assert sensor_of(mapping)[0].channels("taxel")
    assert mapping.remarks


def test_every_key_is_explained():
    """A key that the page does not mention is a key that nobody will find."""
    models = [one for one in vars(model).values()
              if isinstance(one, type) and issubclass(one, BaseModel) and one.__module__ == model.__name__]  # fmt: skip
    keys = {name for one in (*models, DeclaredTask) for name in one.model_fields}
    assert [name for name in sorted(keys) if not re.search(rf"\b{name}\b", PAGE)] == []
