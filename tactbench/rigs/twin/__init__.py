"""The twin: a simulated rig that needs nothing but this package (see ``docs/twin.md``)."""

from __future__ import annotations

from tactbench.plugin import EffectDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 1

_HERE = "tactbench.rigs.twin"


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Offer the rig."""
    return [RigDescriptor(name="twin", title="Simulated twin", where=f"{_HERE}.rig:build", simulated=True)]


@hookimpl
def tactbench_effects() -> list[EffectDescriptor]:
    """Offer the twin's own effects."""
    return [
        _effect("creep", "Creep of the skin", "effects.creep:apply", (), ("effective-force",)),
        _effect("contact", "Normal contact", "contact.stages:press_skin", ("effective-force", "core"), ("skin",)),
        _effect("core", "Touch-down on the core", "contact.core:with_core", (), ("core",)),
        _effect("fluid-pressure", "Fluid pressure", "contact.stages:watch_fluid", ("skin",), ("dc_pressure", "fluid")),
        _effect("gain", "Scatter of gains", "effects.gain:apply", (), ("gain",)),
        _effect("transduction", "Transduction", "contact.stages:read_skin", ("skin", "gain"), ("taxel", "reading")),
        _effect("rest-spread", "Scatter of rest levels", "effects.rest_spread:apply", (), ("disturbance",)),
        _effect("offset", "Offsets", "effects.offset:apply", (), ("disturbance",)),
        _effect("warm-up", "Shared warm-up", "effects.warm_up:apply", (), ("disturbance",)),
        _effect("wander", "Free drift", "effects.wander:apply", (), ("disturbance",)),
        _effect("white-noise", "White noise", "effects.white_noise:apply", (), ("disturbance",)),
        *_sliding(),
        _effect("converter", "Converter", "effects.converter:apply", ("reading", "disturbance"), ("stored",)),
        _effect(
            "force-noise",
            "Noise of the force sensor",
            "effects.force_noise:apply",
            ("tangential-force",),
            ("reference-force",),
        ),
    ]


def _sliding() -> list[EffectDescriptor]:
    here = "effects.called_for_sliding"
    shaken = ("slip", "skin")
    heard = ("skin", "fluid", "vibration")
    return [
        _effect("friction", "Friction", "effects.friction:apply", ("skin",),
                ("slip", "tangential-force", "reference-force"), here),
        _effect("skin-vibration", "Vibration of the skin", "effects.skin_vibration:apply", shaken, ("vibration",), here),
        _effect("ac-pressure", "Dynamic pressure", "effects.ac_pressure:apply", heard, ("ac_pressure", "reading"), here),
        _effect("hum", "Hum of dynamic pressure", "effects.hum:apply", (), ("disturbance",), here),
    ]  # fmt: skip


def _effect(
    name: str,
    title: str,
    where: str,
    consumes: tuple[str, ...],
    produces: tuple[str, ...],
    predicates: str = "effects.called_for",
) -> EffectDescriptor:
    return EffectDescriptor(
        name=name,
        title=title,
        where=f"{_HERE}.{where}",
        consumes=consumes,
        produces=produces,
        called_for=f"{_HERE}.{predicates}:{name.replace('-', '_')}",
    )
