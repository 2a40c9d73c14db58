"""What the documentation and the examples show is what the model reads."""

import re
from pathlib import Path

import pytest

from tactbench.core.recording.mapping import import_tables
from tactbench.core.recording.mapping.channels import sensor_of
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.recording.reader import open_recording
from tactbench.core.spec.yaml_file import load_yaml

ROOT = Path(__file__).resolve().parents[4]


def test_the_blocks_of_the_page_make_one_mapping(tmp_path):
    page = (ROOT / "docs" / "mappings.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 4
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
    assert f"tactbench import examples/mappings/{path.name} --root" in path.read_text(encoding="utf-8")
    assert mapping.remarks
    text = path.read_text(encoding="utf-8")
    assert re.search(r"^# Source: github.com/[\w.-]+/[\w.-]+ @ [0-9a-f]{40} ", text, flags=re.MULTILINE)
    assert "\n# Files: " in text


def test_the_six_files_of_the_grasps_have_the_roles_that_their_authors_give_them(tmp_path):
    """Three of them are not among the public data of the other tests; these are made up."""
    columns = [f"{finger}_biotac_{place}" for finger in ("ff", "mf", "th") for place in range(1, 25)]
    for way in ("down", "side", "45"):
        for name in (f"bts3v2_palm_{way}.csv", f"bts3v2_palm_{way}_test.csv"):
            lines = [",".join(["object", "slipped", *columns])]
            lines += [",".join(["cup", str(row % 2), *(str(100 + row) for _ in columns)]) for row in range(3)]
            (tmp_path / name).write_text("\n".join(lines))
    path = ROOT / "examples" / "mappings" / "biotacsp-stability.yaml"
    report = import_tables(path, root=tmp_path, out=tmp_path / "out")
    roles = {}
    for one in report.recordings:
        with open_recording(one.path) as recording:
            roles[recording.meta.session] = recording.meta.role
    assert roles == {
        **dict.fromkeys(("palm_down", "palm_side", "palm_45"), "train"),
        **dict.fromkeys(("palm_down_test", "palm_side_test", "palm_45_test"), "test"),
    }


def test_every_key_is_explained():
    """A key that the page does not mention is a key that nobody will find."""
    from pydantic import BaseModel

    from tactbench.core.recording.mapping import model

    page = (ROOT / "docs" / "mappings.md").read_text(encoding="utf-8")
    models = [value for value in vars(model).values() if isinstance(value, type) and issubclass(value, BaseModel)
              and value.__module__ == model.__name__]  # fmt: skip
    keys = {name for one in models for name in one.model_fields}
    missing = sorted(name for name in keys if not re.search(rf"\b{name}\b", page))
    assert missing == []
