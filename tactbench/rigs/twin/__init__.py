"""The twin: a simulated rig that needs nothing but this package (see ``docs/twin.md``)."""

from __future__ import annotations

from tactbench.plugin import IndenterDescriptor, Parameter, RigDescriptor, hookimpl
from tactbench.plugin.simulation import EffectDescriptor

TACTBENCH_API = 2

_HERE = "tactbench.rigs.twin"


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Return the descriptor of the twin, the simulated rig."""
    return [
        RigDescriptor(
            name="twin",
            title="Simulated twin",
            where=f"{_HERE}.rig:build",
            simulated=True,
            rungs=("closed-form", "default", "fine", "reference"),
            work_precision=f"{_HERE}.work_precision:study",
            verification=f"{_HERE}.verify:verdicts",
        )
    ]


@hookimpl
def tactbench_effects() -> list[EffectDescriptor]:
    """Return the descriptors of the effects that this package provides for the twin."""
    return [
        _effect("force-loop", "Motor under force control", "effects.force_loop:apply", "", "load reference-force"),
        _effect("contact", "Normal contact", "contact.stages:press_skin", "load core", "skin"),
        _effect("core", "Touch-down on the core", "contact.shell:with_core", "", "core"),
        _effect("fluid-pressure", "Fluid pressure", "contact.press:Press", "skin", "dc_pressure fluid"),
        _effect("shear", "Tangential state of the skin", "contact.tangential:tangential_of", "", "shear"),
        _channels("gain", "Scatter of gains", produces="gain"),
        _effect("creep", "Creep of the skin", "effects.creep:apply", "load skin gain", "effective-force"),
        _effect(
            "transduction", "Transduction", "contact.stages:read_skin",
            "skin gain effective-force vibration shear slip", "taxel reading",
        ),
        _effect("contact-heat", "Heat through the contact", "effects.heat:contact_heat", "skin", "warmth"),
        _effect(
            "dc-temperature", "Temperature of the core", "effects.heat:dc_temperature", "warmth",
            "dc_temperature reading",
        ),
        _effect(
            "ac-temperature", "Rate of the core's temperature", "effects.heat:ac_temperature", "warmth",
            "ac_temperature reading",
        ),
        _effect(
            "thermal-drift", "Drift with the fluid's temperature", "effects.heat:thermal_drift", "warmth taxel",
            "disturbance", "heat",
        ),
        _channels("rest-spread", "Scatter of rest levels"),
        _channels("unit-rest", "Rest levels of another unit"),
        _channels("offset", "Offsets", group="drift"),
        _channels("warm-up", "Shared warm-up", group="drift"),
        _channels("wander", "Free drift", group="drift"),
        _channels("white-noise", "White noise", group="noise"),
        _effect("friction", "Friction", "effects.friction:apply", "skin", "slip tangential-force reference-force"),
        _effect("skin-vibration", "Skin vibration", "effects.skin_vibration:apply", "slip skin", "vibration"),
        _effect(
            "ac-pressure", "Dynamic pressure", "effects.skin_vibration:ac_pressure", "skin fluid vibration",
            "ac_pressure reading",
        ),
        _channels("hum", "Hum of dynamic pressure", group="noise"),
        _channels("converter", "Converter", "reading disturbance", "stored"),
        _channels(
            "force-noise", "Noise of the force sensor", "load tangential-force", "raw-force reference-force", "noise"
        ),
        _channels(
            "force-filter", "Low-pass of the recorded force", "load tangential-force raw-force", "reference-force"
        ),
    ]  # fmt: skip


@hookimpl
def tactbench_indenters() -> list[IndenterDescriptor]:
    """Return the descriptors of the usual indenters; a scene stores the radius of a cap, and none of a flat surface."""
    radius = Parameter(default=10.0, unit="mm", least=0.01, text="radius of its round side")
    return [
        _indenter("cap", "Spherical cap", radius=radius),
        _indenter("flat", "Flat surface that covers the sensor"),
        _indenter("cylinder", "Cylinder lying along x, longer than the sensor", radius=radius),
        _indenter(
            "edge",
            "Wedge along x with a rounded tip, longer than the sensor",
            wedge_angle=Parameter(
                default=120.0, unit="deg", least=30.0, most=179.0,
                text="between its flanks; below 90 deg the simulated rig does not stand for them",
            ),
            tip_radius=Parameter(default=0.5, unit="mm", text="radius of its tip; 0 is sharp"),
        ),
        _indenter(
            "pin",
            "Upright pin with a flat end",
            radius=Parameter(default=2.0, unit="mm", least=0.01, text="radius of the pin"),
            fillet=Parameter(default=0.0, unit="mm", text="radius of its rounded rim, at most that of the pin"),
        ),
    ]  # fmt: skip


def _indenter(name: str, title: str, **dimensions: Parameter) -> IndenterDescriptor:
    return IndenterDescriptor(name=name, title=title, where=f"{_HERE}.geometry:{name}", dimensions=dimensions)


def _effect(name: str, title: str, where: str, consumes: str, produces: str, group: str = "") -> EffectDescriptor:
    return EffectDescriptor(
        name=name,
        title=title,
        where=f"{_HERE}.{where}",
        consumes=tuple(consumes.split()),
        produces=tuple(produces.split()),
        groups=tuple(group.split()),
        called_for=f"{_HERE}.effects.called_for:{name.replace('-', '_')}",
    )


def _channels(
    name: str, title: str, consumes: str = "", produces: str = "disturbance", group: str = ""
) -> EffectDescriptor:
    return _effect(name, title, f"effects.channels:{name.replace('-', '_')}", consumes, produces, group)
