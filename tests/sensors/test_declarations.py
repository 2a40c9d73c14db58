"""What the three sensors say of themselves, found by the door that everybody uses."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from pydantic import BaseModel

from tactbench.plugin import PhysicalRange, Quantity, SensorSpec, Source, load_object, load_registry

OURS = ("biotac", "icub", "ideal")


@pytest.fixture(scope="module")
def specs() -> dict[str, SensorSpec]:
    registry = load_registry()
    return {name: registry.sensors[name].spec for name in OURS}


def facts(thing: object) -> Iterator[tuple[str, Source | None]]:
    """Every number with its source, however deep."""
    if isinstance(thing, Quantity | PhysicalRange):
        yield str(thing), thing.source
    elif isinstance(thing, BaseModel):
        for name in type(thing).model_fields:
            yield from facts(getattr(thing, name))
    elif isinstance(thing, dict):
        for value in thing.values():
            yield from facts(value)
    elif isinstance(thing, list | tuple):
        for value in thing:
            yield from facts(value)


def test_the_registry_lists_all_three_from_this_distribution() -> None:
    registry = load_registry()
    assert set(OURS) <= set(registry.sensors.names())
    assert {registry.sensors.owned(name).distribution for name in OURS} == {"tactbench"}


@pytest.mark.parametrize("name", OURS)
def test_every_fact_says_where_it_comes_from(specs: dict[str, SensorSpec], name: str) -> None:
    found = list(facts(specs[name]))
    assert len(found) > 20  # the walk reaches the channels, the skin and the nuisances
    for fact, source in found:
        assert source is not None, fact
        assert len(source.reference) > 5, fact


@pytest.mark.parametrize("name", OURS)
def test_every_rate_and_every_place_has_a_source(specs: dict[str, SensorSpec], name: str) -> None:
    for stream in specs[name].streams:
        assert (stream.rate_hz is None) == (stream.rate_source is None)
        for channel in stream.channels:
            assert (channel.position_m is None) == (channel.position_source is None)


@pytest.mark.parametrize("name", OURS)
def test_normals_are_unit_vectors(specs: dict[str, SensorSpec], name: str) -> None:
    normals = [channel.normal for channel in specs[name].channels() if channel.normal is not None]
    # Stored as float64: three squares and a root lose a few units in the last place.
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("name", OURS)
def test_rest_levels_lie_inside_the_converter(specs: dict[str, SensorSpec], name: str) -> None:
    for channel in specs[name].channels():
        assert channel.rest is not None
        if channel.lower is not None and channel.upper is not None:
            assert channel.lower < channel.rest.to(channel.unit) < channel.upper


@pytest.mark.parametrize("name", OURS)
def test_the_converter_fits_the_stored_type(specs: dict[str, SensorSpec], name: str) -> None:
    for stream in specs[name].streams:
        if stream.dtype.startswith("uint"):
            bound = np.iinfo(stream.dtype).max
            assert all(channel.upper is not None and channel.upper <= bound for channel in stream.channels)


@pytest.mark.parametrize("name", OURS)
def test_each_kind_of_channel_has_its_nuisances(specs: dict[str, SensorSpec], name: str) -> None:
    kinds = {channel.kind for channel in specs[name].channels()}
    assert set(specs[name].nuisances) == kinds


@pytest.mark.parametrize("name", OURS)
def test_the_transducer_is_where_the_descriptor_says(name: str) -> None:
    where = load_registry().sensors[name].transducer
    assert where is not None
    assert callable(load_object(where))


def test_table_one_of_the_paper_comes_out(specs: dict[str, SensorSpec]) -> None:
    biotac, icub = specs["biotac"], specs["icub"]
    assert (len(biotac.channels("taxel")), len(icub.channels("taxel"))) == (19, 12)
    assert (biotac.principle, icub.principle) == ("resistive", "capacitive")
    (pressure,) = biotac.channels("dc_pressure")
    (temperature,) = biotac.channels("dc_temperature")
    (vibration,) = biotac.channels("ac_pressure")
    (flow,) = biotac.channels("ac_temperature")
    assert str(pressure.measures) == "0–100 kPa"
    assert str(temperature.measures) == "0–75 degC"
    assert str(vibration.band) == "10–1040 Hz"
    assert str(flow.band) == "0.45–22.6 Hz"
    assert {channel.kind for channel in icub.channels()} == {"taxel"}


def test_biotac_has_one_stream_per_clock(specs: dict[str, SensorSpec]) -> None:
    electrodes, vibration = specs["biotac"].streams
    assert (electrodes.rate_hz, vibration.rate_hz) == (100.0, 2200.0)
    assert [channel.name for channel in electrodes.channels] == [
        *(f"E{n}" for n in range(1, 20)),
        "PDC",
        "TDC",
        "TAC",
    ]
    assert [channel.name for channel in vibration.channels] == ["PAC"]


def test_biotac_electrodes_lie_on_the_core(specs: dict[str, SensorSpec]) -> None:
    core = specs["biotac"].parameters["core_radius"].to("mm")
    for channel in specs["biotac"].channels("taxel"):
        assert channel.position_m is not None
        x, y, z = (1e3 * c for c in channel.position_m)
        if x <= 0.0:
            # The table is rounded to a micrometre.
            assert np.hypot(y, z) == pytest.approx(core, abs=2e-3)
        else:
            # On the dome or on its facet, which lies inside the sphere.
            assert 4.4 <= np.sqrt(x * x + y * y + z * z) <= 6.0


def test_icub_taxels_lie_on_the_outer_surface_and_fall_under_pressure(specs: dict[str, SensorSpec]) -> None:
    spec = specs["icub"]
    assert spec.skin is not None
    assert spec.skin.sheet.outer_radius is not None
    outer = spec.skin.sheet.outer_radius.to("mm")
    for channel in spec.channels("taxel"):
        assert channel.position_m is not None
        _, y, z = (1e3 * c for c in channel.position_m)
        assert np.hypot(y, z) == pytest.approx(outer, abs=1e-9)
        assert channel.sign == -1


def test_the_ideal_sensor_has_no_nuisance_at_all(specs: dict[str, SensorSpec]) -> None:
    (none,) = specs["ideal"].nuisances.values()
    amounts = [none.white, none.offset_shared, none.offset_own, none.offset_session, none.gain_scatter]
    amounts += [none.warm_up, none.warm_up_scatter, none.wander, none.step]
    assert [amount.value for amount in amounts] == [0.0] * len(amounts)
    assert none.creep == ()


def test_a_spec_that_still_states_its_largest_slope_is_read(specs: dict[str, SensorSpec]) -> None:
    """Recordings keep the spec they were made with; this field is no longer one."""
    stated = specs["icub"].model_dump()
    stated["nuisances"]["taxel"]["largest_slope"] = {
        "value": 24.0,
        "unit": "count/N",
        "source": stated["principle_source"],
    }
    assert SensorSpec.model_validate(stated).nuisances == specs["icub"].nuisances


def test_listing_the_sensors_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "import tactbench.sensors.biotac, tactbench.sensors.icub, tactbench.sensors.ideal\n"
        "heavy = {'scipy', 'h5py', 'sklearn', 'matplotlib', 'can', 'serial', 'rich'} & set(sys.modules)\n"
        "own = [name for name in sys.modules if name.endswith('.transduction')]\n"
        "sys.exit(f'imported {heavy} {own}' if heavy or own else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
