"""What this package brings passes its own checks."""

from __future__ import annotations

import pytest

from tactbench.core.conformance.check import KINDS
from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.evaluation import metrics
from tactbench.core.plugins.registry import installed
from tactbench.core.spec import task as spec_task

OURS = [
    (kind, name)
    for kind in KINDS
    for name in installed().families()[f"{kind}s"].names()
    if installed().families()[f"{kind}s"].owned(name).ours
]
SIMULATED = {"biotac", "icub", "ideal", "twin"}


@pytest.mark.parametrize(("kind", "name"), OURS, ids=[f"{kind}-{name}" for kind, name in OURS])
def test_it_passes(kind, name):
    (subject,) = subjects_named(installed(), name, (kind,))
    report = run_checks(subject, isolated=False)
    assert report.ok, str(report)
    # What moves something real, or asks recordings, shows less without its devices and them.
    shows_less = (kind == "rig" and name not in SIMULATED) or (kind == "task" and not subject.spec.scenes)
    assert report.level in (("bronze", "silver") if shows_less else ("silver",)), str(report)


def test_a_task_may_ask_for_every_metric_that_there_is():
    assert set(spec_task.METRICS) == set(metrics.METRICS)
