"""A figure measured on real units."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from tactbench.plugin import SensorSpec, Source, UsageError, load_registry
from tactbench.plugin.simulation import RealFigure

SOURCE = Source(tag="measured", reference="a test")


def figure(**more: object) -> RealFigure:
    return RealFigure.model_validate(
        {"statistic": "rest-level", "condition": "rest", "low": 1, "high": 3, "typical": 2, "source": SOURCE, **more}
    )


def test_its_name_says_what_it_is_about() -> None:
    assert figure().name == "rest-level"
    assert figure(channels=("E1", "E2"), at=0.5, band=(30, 100)).name == "rest-level, E1 E2, at 0.5 s, 30-100 counts"


@pytest.mark.parametrize("wrong", [{"typical": 4}, {"low": 5}, {"unit": "furlong"}, {"statistic": "Rest level"}])
def test_what_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises((ValidationError, UsageError)):
        figure(**wrong)


def test_no_recording_carries_it_and_no_key_depends_on_it() -> None:
    spec = load_registry().sensors["icub"].spec
    assert spec.likeness
    without = spec.model_copy(update={"likeness": ()})
    assert spec.model_dump_json() == without.model_dump_json()
    assert SensorSpec.model_validate_json(spec.model_dump_json()).likeness == ()
