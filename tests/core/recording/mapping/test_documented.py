"""What the documentation and the examples show is what the model reads."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.mapping import import_tables
from tactbench.core.recording.mapping.channels import sensor_of
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.recording.reader import open_recording
from tactbench.core.spec.declared_task import TaskFile
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


OBJECTS = ("case", "hd", "sponge", "pen", "bottle", "cardboard", "brush", "screw", "striped", "bubbles", "plate")
MOVES = {"n": (1, 0), "s": (-1, 0), "e": (0, 1), "w": (0, -1), "t": (0, 0)}


def test_a_folder_of_slip_directions_is_asked_which_way_it_slipped(tmp_path):
    """The data are not here: the folders are made up, with the files and columns of the source."""
    rng = np.random.default_rng(1)
    number = 0
    for way, move in MOVES.items():
        (tmp_path / "csvs" / way).mkdir(parents=True)
        for name in OBJECTS:
            drift = 40.0 * np.repeat(move, 12)
            X = 3000 + rng.integers(-300, 300, 24) + np.linspace(0, 1, 50)[:, None] * drift + rng.normal(0, 3, (50, 24))
            lines = [",".join(f"ff_e{place}" for place in range(1, 25))]
            lines += [",".join(f"{value:.0f}" for value in row) for row in X]
            (tmp_path / "csvs" / way / f"{name}{number}.csv").write_text("\n".join(lines) + "\n")
            number += 1
    path = ROOT / "examples" / "mappings" / "biotacsp-slip-direction.yaml"
    report = import_tables(path, root=tmp_path, out=tmp_path / "out")
    assert report.tasks == ("slip-direction",)
    assert len(report.recordings) == len(MOVES) * len(OBJECTS)
    (declared,) = load_yaml(tmp_path / "out" / "tasks.yaml", TaskFile).tasks
    paths = [one.path for one in report.recordings]

    def asked(task, estimator):
        return evaluate_cell(
            CellContext(
                task, installed().estimators[estimator], {}, "deployable", None, 1, time.perf_counter, latency=False
            ),
            paths,
        )  # fmt: skip

    result = asked(declared.spec, "logistic")
    assert (result.split, set(result.classes)) == ("object", {"north", "east", "south", "west", "none"})
    # Twelve electrodes end 40 counts from where they began, each known to 3: no direction is taken for another.
    assert result.score == 1.0
    assert asked(declared.spec, "majority").score == pytest.approx(0.2)
    assert asked(installed().tasks["slip-sequence"].spec, "majority").score == pytest.approx(0.8)


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
