"""A figure measured on real units."""

from __future__ import annotations

from tactbench.plugin import SensorSpec, Source, load_registry
from tactbench.plugin.simulation import RealFigure

SOURCE = Source(tag="measured", reference="a test")


def figure(**more: object) -> RealFigure:
    return RealFigure.model_validate(
        {"statistic": "rest-level", "condition": "rest", "low": 1, "high": 3, "typical": 2, "source": SOURCE, **more}
    )


def test_no_recording_carries_it_and_no_key_depends_on_it() -> None:
    spec = load_registry().sensors["icub"].spec
    assert spec.likeness
    without = spec.model_copy(update={"likeness": ()})
    assert spec.model_dump_json() == without.model_dump_json()
    assert SensorSpec.model_validate_json(spec.model_dump_json()).likeness == ()
