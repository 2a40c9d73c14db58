"""Curvature asked of whole recordings of the twin, and slip of the sequences of eFlesh."""

import time
from pathlib import Path

import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.mapping import import_tables
from tactbench.plugin import RigContext, Summary
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.rig import build
from tactbench.tasks import curvature, slip_sequence
from tactbench.tasks.surfaces import in_sessions

CAPS_MM, SESSIONS = (5.0, 40.0), 5
SUMMARISED = curvature.SPEC.model_copy(
    update={
        "answer_per": "recording",
        "summaries": (Summary(measure="mean"), Summary(measure="range"), Summary(measure="change", start=0.5)),
    }
)
VOTED = curvature.SPEC.model_copy(update={"answer_per": "recording", "vote": "frames"})


@pytest.fixture(scope="module", params=["biotac", "icub"])
def campaign(request, tmp_path_factory):
    """Two caps in five sessions, each pressed anew."""
    folder = tmp_path_factory.mktemp(request.param)
    rig = build(RigContext(effects=tuple(tactbench_effects())))
    registry = installed()
    paths = []
    for planned in in_sessions(SESSIONS, CAPS_MM):
        scene = planned.scene.model_copy(update={"observe": ("taxel",)})
        path = folder / f"{scene.name}.h5"
        acquire(
            rig, registry.sensors[request.param], registry.rigs["twin"], scene, role=planned.role, seed=1, path=path,
            clock=time.perf_counter, provenance={},
        )  # fmt: skip
        paths.append(path)
    return paths


def run(task, recordings, split=None, estimator="forest", protocol="deployable", **params):
    return evaluate_cell(
        CellContext(
            task, installed().estimators[estimator], params, protocol, split, seed=1, clock=time.perf_counter,
            latency=False,
        ),
        recordings,
    )  # fmt: skip


@pytest.mark.parametrize("task", [SUMMARISED, VOTED], ids=["summaries", "vote"])
def test_curvature_is_asked_of_whole_recordings_of_the_twin(campaign, task):
    result = run(task, campaign, "session", n_estimators=20)
    assert result.sizes.n_test == len(campaign) == 10
    assert len({*result.sets["test"].recording.tolist()}) == 10
    assert result.interval.method.startswith("jackknife over 5 sessions ")
    # Guessing one of two caps leaves a macro F1 of a half at best.
    assert result.score > run(task, campaign, "session", "majority").score + 0.2
    assert result.tare_s == pytest.approx(7.2, abs=0.1), "the hold of the scenes is tared on as for samples"
    assert result.times.delay_parts_ms["window"] == pytest.approx(60e3 - 7.2e3, rel=0.01)


@pytest.fixture(scope="module")
def sequences(shared_data, tmp_path_factory):
    mapping = Path(__file__).resolve().parents[2] / "examples" / "mappings" / "eflesh-slip.yaml"
    report = import_tables(mapping, root=shared_data / "eflesh", out=tmp_path_factory.mktemp("slip"))
    return load_dataset(slip_sequence.SPEC, [one.path for one in report.recordings])


@pytest.mark.parametrize(
    ("estimator", "params"),
    [("forest", {"n_estimators": 20}), ("svm", {}), ("logistic", {})],
    ids=["forest", "svm", "logistic"],
)
def test_slip_of_real_sequences_by_blocks_of_neighbours(sequences, estimator, params):
    """The notes of the data have 0.978 of eight blocks, 0.993 of shuffled folds and 0.752 of always 'slipped'."""
    found = run(slip_sequence.SPEC, sequences, estimator=estimator, **params)
    assert found.split == "block", "nothing stricter is labelled: no object and one session"
    assert found.sizes.n_test == 137
    assert found.score >= 0.96
    trivial = run(slip_sequence.SPEC, sequences, estimator="majority")
    assert trivial.score == pytest.approx(103 / 137)
    assert found.interval.low > trivial.score


def test_slip_of_real_sequences_has_no_official_test_and_no_time_to_cut(sequences):
    with pytest.raises(NotApplicable, match="cuts recordings in time"):
        run(slip_sequence.SPEC, sequences, "in-session")
    first = run(slip_sequence.SPEC, sequences, protocol="first-frame", n_estimators=20)
    assert first.score < 0.85, "where a channel stands at the start does not name slip"
