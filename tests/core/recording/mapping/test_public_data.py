"""The ready mappings, on the three public data sets they are made for.

Expected figures are those of the data sets' own description, counted on the files independently of tactbench.
"""

from collections import Counter

import numpy as np
import pytest

from tactbench.core.recording.mapping import import_tables
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tests.conftest import ROOT

FOLDERS = {"eflesh": "eflesh", "biotacsp": "biotacsp-stability-v2"}


@pytest.fixture
def imported(shared_data, tmp_path):
    """Imports by name of the mapping."""

    def go(name):
        mapping, root = ROOT / "examples" / "mappings" / f"{name}.yaml", shared_data / FOLDERS[name.split("-")[0]]
        return import_tables(mapping, root=root, out=tmp_path / name)

    return go


def opened(report):
    for one in report.recordings:
        with open_recording(one.path) as recording:
            yield recording


def test_eflesh_normal(imported):
    report = imported("eflesh-normal")
    for recording in opened(report):
        taxels, force = recording.read("magnetometers"), recording.read("load_cell")
        assert taxels.data.shape == (3600, 15)
        assert np.array_equal(np.bincount(taxels.annotations["press"]), np.full(10, 360))
        there = (force.quality[:, 0] & Quality.MISSING) == 0
        assert np.array_equal(there, ~np.isnan(force.data[:, 0]))
        steps = np.diff(taxels.t_ns) * 1e-9
        assert (steps > 0).all()
        assert np.median(steps) == pytest.approx(0.073, abs=0.0005)  # the description gives three decimals
        assert len(steps) / steps.sum() == pytest.approx(9.5, abs=0.05)  # and here one
        # A row's two clocks differ by less than 5 ms.
        assert np.abs(taxels.t_ns - force.t_ns).max() < 5e6
        assert recording.meta.clock == "host"
    assert [one.name for one in report.recordings] == ["normal-20250401_014340", "normal-20250401_015037"]
    assert "irregular" in {finding.check for finding in report.recordings[0].findings}


def test_biotacsp_stability(imported):
    report = imported("biotacsp-stability")
    assert report.rows == 5193
    rows, objects = {}, {}
    for recording in opened(report):
        data, meta = recording.read("electrodes"), recording.meta
        slipped = Counter(data.annotations["slipped"].tolist())
        rows[meta.session] = (meta.role, slipped["stable"], slipped["slipped"])
        objects[meta.session] = set(data.annotations["object"].tolist())
        assert (data.t_ns, data.data.shape[1]) == (None, 72)
    assert rows == {
        "palm_down": ("train", 667, 609),
        "palm_side": ("train", 603, 670),
        "palm_45": ("train", 1058, 1075),
        "palm_45_test": ("test", 250, 261),
    }
    assert objects["palm_down"] == objects["palm_side"] == objects["palm_45"]
    assert (len(objects["palm_45"]), len(objects["palm_45_test"])) == (41, 10)
    assert not objects["palm_45_test"] & objects["palm_45"]


def test_icub_grasp(shared_data, tmp_path):
    """Three of its ten objects."""
    (tmp_path / "iCubGraspDataset").mkdir()
    for name in ("full_coke", "empty_coke", "none"):
        for path in (shared_data / "icub-grasp" / "iCubGraspDataset").glob(f"{name}_*.txt"):
            (tmp_path / "iCubGraspDataset" / path.name).symlink_to(path)
    mapping = ROOT / "examples" / "mappings" / "icub-grasp.yaml"
    report = import_tables(mapping, root=tmp_path, out=tmp_path / "out")
    assert (report.files_read, *report.excluded.values()) == (70, 27)
    trials = Counter()
    for recording in opened(report):
        meta, taxels = recording.meta, recording.read("taxels").data
        trials[meta.labels["object"]] += 1
        assert bool(meta.excluded) == (meta.labels["object"] == "full_coke")
        assert (taxels.shape[1], taxels.dtype) == (60, np.uint8)
    assert trials == {"full_coke": 27, "empty_coke": 21, "none": 22}
