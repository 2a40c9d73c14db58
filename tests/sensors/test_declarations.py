"""What the three sensors state of themselves, beyond what the conformance kit checks of every sensor."""

import pytest
from pydantic import BaseModel

from tactbench.plugin import PhysicalRange, Quantity, SensorSpec, load_registry

SPECS = {name: load_registry().sensors[name].spec for name in ("biotac", "icub", "ideal")}


def facts(thing):
    """Yield every number with its source, however deep."""
    if isinstance(thing, Quantity | PhysicalRange):
        yield str(thing), thing.source
    elif isinstance(thing, BaseModel):
        for name in type(thing).model_fields:
            yield from facts(getattr(thing, name))
    elif isinstance(thing, dict | list | tuple):
        for value in thing.values() if isinstance(thing, dict) else thing:
            yield from facts(value)


@pytest.mark.parametrize("name", SPECS)
def test_every_fact_says_where_it_comes_from(name):
    found = list(facts(SPECS[name]))
    assert len(found) > 20  # the walk reaches the channels, the skin and the nuisances
    assert not [fact for fact, source in found if source is None or len(source.reference) <= 5]


def test_a_spec_that_still_states_its_largest_slope_is_read():
    """Recordings keep the spec they were made with; this field is no longer one."""
    stated = SPECS["icub"].model_dump()
    slope = {"value": 24.0, "unit": "count/N", "source": stated["principle_source"]}
    stated["nuisances"]["taxel"]["largest_slope"] = slope
    assert SensorSpec.model_validate(stated).nuisances == SPECS["icub"].nuisances
