"""A ready mapping, on the data set that it is made for; the others are imported by the tests of scores."""

from collections import Counter

import numpy as np

from tactbench.core.recording.mapping import import_tables
from tactbench.core.recording.reader import open_recording
from tests.conftest import ROOT


def test_icub_grasp(shared_data, tmp_path):
    """Three of its ten objects."""
    (tmp_path / "iCubGraspDataset").mkdir()
    for path in (shared_data / "icub-grasp" / "iCubGraspDataset").glob("*.txt"):
        if path.name.startswith(("full_coke_", "empty_coke_", "none_")):
            (tmp_path / "iCubGraspDataset" / path.name).symlink_to(path)
    mapping = ROOT / "examples" / "mappings" / "icub-grasp.yaml"
    report = import_tables(mapping, root=tmp_path, out=tmp_path / "out")
    trials = Counter()
    for one in report.recordings:
        with open_recording(one.path) as recording:
            taxels = recording.read("taxels").data
            trials[recording.meta.labels["object"], recording.meta.excluded != ""] += 1
        assert (taxels.shape[1], taxels.dtype) == (60, np.uint8)
    assert trials == {("full_coke", True): 27, ("empty_coke", False): 21, ("none", False): 22}
