"""What the documentation and the examples show is what the model reads."""

import re
from pathlib import Path

import pytest

from tactbench.core.recording.mapping.channels import sensor_of
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.spec.yaml_file import load_yaml

ROOT = Path(__file__).resolve().parents[4]


def test_the_blocks_of_the_page_make_one_mapping(tmp_path):
    page = (ROOT / "docs" / "mappings.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 5
    path = tmp_path / "mapping.yaml"
    path.write_text("".join(blocks), encoding="utf-8")
    sensor, reference, _ = sensor_of(load_yaml(path, Mapping))
    assert [channel.name for channel in sensor.channels()][:4] == ["m1x", "m1y", "m1z", "m2x"]
    assert reference[0].channels[0].unit == "N"


@pytest.mark.parametrize("path", sorted((ROOT / "examples" / "mappings").glob("*.yaml")), ids=lambda path: path.stem)
def test_an_example(path):
    mapping = load_yaml(path, Mapping)
    sensor, _, _ = sensor_of(mapping)
    assert sensor.channels("taxel")
    assert mapping.remarks


def test_every_key_is_explained():
    """A key that the page does not mention is a key that nobody will find."""
    from pydantic import BaseModel

    from tactbench.core.recording.mapping import model
    from tactbench.core.spec import declared_task

    page = (ROOT / "docs" / "mappings.md").read_text(encoding="utf-8")
    models = [value for where in (model, declared_task) for value in vars(where).values()
              if isinstance(value, type) and issubclass(value, BaseModel)
              and value.__module__ == where.__name__]  # fmt: skip
    keys = {name for one in models for name in one.model_fields}
    missing = sorted(name for name in keys if not re.search(rf"\b{name}\b", page))
    assert missing == []
