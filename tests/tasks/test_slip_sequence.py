"""Slip, asked of the real sequences of eFlesh."""

from pathlib import Path

import pytest

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.tasks import slip
from tests.core.evaluation.made import evaluated


@pytest.fixture(scope="module")
def sequences(shared_data, tmp_path_factory):
    mapping = Path(__file__).resolve().parents[2] / "examples" / "mappings" / "eflesh-slip.yaml"
    report = import_tables(mapping, root=shared_data / "eflesh", out=tmp_path_factory.mktemp("slip"))
    return load_dataset(slip.SEQUENCE, [one.path for one in report.recordings])


def test_slip_of_real_sequences_by_blocks_of_neighbours(sequences):
    """The notes of the data have 0.978 of eight blocks, 0.993 of shuffled folds and 0.752 of always 'slipped'."""
    found = evaluated(slip.SEQUENCE, sequences, "forest", params={"n_estimators": 10})
    assert found.split == "block", "nothing stricter is labelled: no object and one session"
    assert found.n_test == 137
    assert found.score >= 0.96
    trivial = evaluated(slip.SEQUENCE, sequences, "majority")
    assert trivial.score == pytest.approx(103 / 137)
    assert found.ci_low is None, "less than five blocks hold sequences without a slip"
    assert min(found.replicates["own"]) > trivial.score


def test_slip_of_real_sequences_has_no_official_test_and_no_time_to_cut(sequences):
    with pytest.raises(NotApplicable, match="cuts recordings in time"):
        evaluated(slip.SEQUENCE, sequences, "forest", split="in-session")
    first = evaluated(slip.SEQUENCE, sequences, "forest", "first-frame", params={"n_estimators": 10})
    assert first.score < 0.85, "where a channel stands at the start does not name slip"
