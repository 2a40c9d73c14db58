"""A procedure that contradicts itself is refused; the one that comes along does not."""

import pytest
from pydantic import ValidationError

from tactbench.core.calibration.trial import checked
from tactbench.core.cli.config import default_calibration
from tests.core.calibration.toy import procedure


def _changed(part, place, **change):
    lines = [one.model_dump(mode="json") for one in getattr(procedure(), part)]
    lines[place].update(change)
    return {part: lines}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (_changed("nuisances", 1, name="width"), "two of one name: nuisance 'width'"),
        (_changed("outputs", 1, name="narrow"), "two of one name: output 'narrow'"),
        (_changed("published", 0, output="tall"), "two of one name: published number 'tall'"),
        (_changed("published", 0, output="narow"), "did you mean 'narrow'"),
        (_changed("outputs", 0, stands_for="wide"), "no output is called 'wide'"),
        (_changed("published", 0, scale=0.0), "greater than 0"),
        (_changed("nuisances", 0, prior={"kind": "uniform", "low": 1.0, "high": 1.0}), "low < high"),
        (_changed("nuisances", 0, prior={"kind": "log-uniform", "low": 0.0, "high": 1.0}), "greater than 0"),
        ({"published": [one.model_copy(update={"use": "held out"}) for one in procedure().published]}, "fitted"),
        ({"tolerance": 0}, "greater than 0"),
    ],
)
def test_a_contradiction_is_refused(change, says):
    with pytest.raises(ValidationError, match=says):
        procedure(**change)


def test_the_procedure_that_comes_along_names_only_what_is_installed():
    spec = default_calibration()
    checked(spec)
    assert {one.use for one in spec.published} == {"fitted", "held out"}


def test_published_numbers_are_those_of_the_tasks():
    from tactbench.core.plugins.registry import load_registry

    registry, spec = load_registry(), default_calibration()
    beside = 0
    for one in spec.published:
        output = spec.output(one.output)
        for published in registry.tasks[output.task].spec.published:
            same = published.sensor in (output.sensor, None) and published.protocol == spec.protocol
            if same and published.estimator == output.estimator.name:
                assert one.value == published.score
                beside += 1
    assert beside >= 4
