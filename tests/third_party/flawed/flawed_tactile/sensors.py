"""Sensors with one flaw each."""

import itertools
import math

from pydantic import ConfigDict

from tactbench.plugin import (
    ChannelSpec,
    PhysicalRange,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    assumed,
    hookimpl,
)
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
MINE = "its maker"
SOURCE = Source(tag="assumed", reference=MINE)
PLACES_MM = ((-3.0, -1.5), (-3.0, 1.5), (2.0, -1.5), (2.0, 1.5))
TAXELS = tuple(
    ChannelSpec(
        name=f"t{place}",
        kind="taxel",
        lower=0,
        upper=4095,
        rest=assumed(100, "count", MINE),
        sign=1,
        position_m=(x / 1e3, y / 1e3, 0.0),
        normal=(0.0, 0.0, 1.0),
    )
    for place, (x, y) in enumerate(PLACES_MM, 1)
)
SKIN = BondedLayer(
    sheet=SkinSheet(
        x_min=assumed(-6, "mm", MINE), x_max=assumed(6, "mm", MINE), arc=assumed(12, "mm", MINE), cells=(24, 24)
    ),
    young=assumed(0.5, "MPa", MINE),
    poisson=assumed(0.3, "1", MINE),
    thickness=assumed(2, "mm", MINE),
    contact_stiffness=assumed(15, "MPa/mm", MINE),
)
NOISE = Nuisances(white=assumed(1, "count", MINE), step=assumed(1, "count", MINE))
PAD = SensorSpec(
    name="sound-pad",
    title="Sound pad",
    principle="capacitive",
    principle_source=SOURCE,
    streams=(StreamSpec(name="taxels", rate_hz=100.0, dtype="uint16", channels=TAXELS),),
    skin=SKIN,
    parameters={"contact_x": assumed(0.0, "mm", MINE)},
    nuisances={"taxel": NOISE},
    link_delay=assumed(1.0, "ms", MINE),
)


class MutableSpec(SensorSpec):
    model_config = ConfigDict(frozen=False)


def with_(model, **changes):
    return model.model_copy(update=changes)


def channel(**changes):
    """Return the pad with another last taxel."""
    return stream(channels=(*TAXELS[:-1], with_(TAXELS[-1], **changes)))


def stream(**changes):
    return with_(PAD, streams=(with_(PAD.streams[0], **changes),))


def noise(kind="taxel", **changes):
    return with_(PAD, nuisances={kind: with_(NOISE, **changes) if changes else NOISE})


asked = itertools.count()

SPECS = {
    "holds-nan": channel(measures=PhysicalRange(lower=0.0, upper=math.nan, unit="N", source=SOURCE)),
    "says-not-who-says-so": with_(PAD, link_delay=assumed(1.0, "ms", " ")),
    "has-no-title": with_(PAD, title="TODO"),
    "takes-the-name-of-the-force-stream": stream(name="force_torque"),
    "rests-beyond-its-limits": channel(rest=assumed(5000, "count", MINE)),
    "has-limits-beyond-its-type": channel(upper=70_000),
    "hides-its-saturation": channel(upper=None),
    "measures-force-in-metres": channel(kind="force", unit="m", rest=None),
    "states-a-period-as-rate": stream(rate_hz=0.01),
    "has-one-taxel-without-a-place": channel(position_m=None),
    "is-placed-in-millimetres": channel(position_m=(2.0, 1.5, 0.0)),
    "has-two-taxels-in-one-place": channel(position_m=TAXELS[0].position_m),
    "has-a-taxel-off-its-skin": channel(position_m=(0.02, 0.0, 0.0)),
    "has-a-long-normal": channel(normal=(0.0, 1.0, 1.0)),
    "is-touched-off-its-skin": with_(PAD, parameters={"contact_x": assumed(60, "mm", MINE)}),
    "has-a-skin-without-stiffness": with_(PAD, skin=with_(SKIN, young=assumed(0.0, "MPa", MINE))),
    "has-noise-of-another-kind": noise("dc_pressure"),
    "has-noise-in-volts": noise(white=assumed(1e-3, "V", MINE)),
    "has-negative-noise": noise(white=assumed(-1.0, "count", MINE)),
    "is-heard-a-minute-late": with_(PAD, link_delay=assumed(1.0, "min", MINE)),
}
TRANSDUCERS = (
    "takes-no-grid", "writes-into-the-spec", "leaves-one-taxel-out", "is-nan-at-rest", "is-nan-over-range",
    "rests-elsewhere", "keeps-its-own-order", "remembers", "changes-the-state", "feels-nothing", "swaps-axes",
    "mirrors", "turns-the-sign", "falls-back", "is-in-grams", "reads-shear", "folds-shear", "forgets-shear",
)  # fmt: skip
READS_SHEAR = ("reads-shear", "folds-shear", "forgets-shear")
DRIVERS = (
    "opens-two-lines", "is-a-number", "has-a-stream-of-its-own", "goes-back-in-time", "swaps-taxels", "doubles-samples",
    "keeps-what-waited", "waits-anyhow", "leaves-its-line-open", "hides-the-unplugging", "takes-any-option",
)  # fmt: skip


def code(name):
    return name.replace("-", "_")


@hookimpl
def tactbench_sensors():
    wired = {"emulator": "flawed_tactile.line:build_emulator", "emulated_link": "bytes"}
    return [
        SensorDescriptor(
            spec=PAD, transducer="flawed_tactile.transducers:sound", driver="flawed_tactile.line:sound", **wired
        ),
        SensorDescriptor(spec=with_(PAD, name="is-not-at-that-address"), driver="flawed_tactile.line:sound", **wired),
        SensorDescriptor(
            spec=with_(PAD, name="names-code-that-is-not-there"), transducer="flawed_tactile.transducers:build"
        ),
        SensorDescriptor(spec=MutableSpec(**{**dict(PAD), "name": "lets-its-fields-be-set"})),
        SensorDescriptor(spec=with_(PAD, name="is-another-each-time", link_delay=assumed(next(asked), "ms", MINE))),
        *(SensorDescriptor(spec=with_(spec, name=name)) for name, spec in SPECS.items()),
        *(
            SensorDescriptor(
                spec=with_(
                    PAD,
                    name=f"transducer-{name}",
                    parameters=dict(PAD.parameters),
                    reads_shear=("taxel",) if name in READS_SHEAR else (),
                ),
                transducer=f"flawed_tactile.transducers:{code(name)}",
            )
            for name in TRANSDUCERS
        ),
        *(
            SensorDescriptor(
                spec=with_(PAD, name=f"driver-{name}"), driver=f"flawed_tactile.line:{code(name)}", **wired
            )
            for name in DRIVERS
        ),
    ]
