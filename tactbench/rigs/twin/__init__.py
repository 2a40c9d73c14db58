"""The twin: a simulated rig that needs nothing but this package (see ``docs/twin.md``)."""

from __future__ import annotations

from tactbench.plugin import EffectDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 1

_HERE = "tactbench.rigs.twin"
_DRIFT, _NOISE = ("drift",), ("noise",)


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Offer the rig."""
    return [
        RigDescriptor(
            name="twin",
            title="Simulated twin",
            where=f"{_HERE}.rig:build",
            simulated=True,
            rungs=("closed-form", "default", "fine", "reference"),
            work_precision=f"{_HERE}.work_precision:study",
            verification=f"{_HERE}.verification.everything:checks",
        )
    ]


@hookimpl
def tactbench_effects() -> list[EffectDescriptor]:
    """Offer the twin's own effects."""
    return [
        _effect("creep", "Creep of the skin", "effects.creep:apply", (), ("effective-force",)),
        _effect("contact", "Normal contact", "contact.stages:press_skin", ("effective-force", "core"), ("skin",)),
        _effect("core", "Touch-down on the core", "contact.core:with_core", (), ("core",)),
        _effect("fluid-pressure", "Fluid pressure", "contact.stages:watch_fluid", ("skin",), ("dc_pressure",)),
        _effect("gain", "Scatter of gains", "effects.gain:apply", (), ("gain",)),
        _effect("transduction", "Transduction", "contact.stages:read_skin", ("skin", "gain"), ("taxel", "reading")),
        _effect("rest-spread", "Scatter of rest levels", "effects.rest_spread:apply", (), ("disturbance",)),
        _effect("offset", "Offsets", "effects.offset:apply", (), ("disturbance",), groups=_DRIFT),
        _effect("warm-up", "Shared warm-up", "effects.warm_up:apply", (), ("disturbance",), groups=_DRIFT),
        _effect("wander", "Free drift", "effects.wander:apply", (), ("disturbance",), groups=_DRIFT),
        _effect("white-noise", "White noise", "effects.white_noise:apply", (), ("disturbance",), groups=_NOISE),
        _effect("converter", "Converter", "effects.converter:apply", ("reading", "disturbance"), ("stored",)),
        _effect(
            "force-noise",
            "Noise of the force sensor",
            "effects.force_noise:apply",
            (),
            ("reference-force",),
            groups=_NOISE,
        ),
    ]


def _effect(
    name: str,
    title: str,
    where: str,
    consumes: tuple[str, ...],
    produces: tuple[str, ...],
    predicates: str = "effects.called_for",
    groups: tuple[str, ...] = (),
) -> EffectDescriptor:
    return EffectDescriptor(
        name=name,
        title=title,
        where=f"{_HERE}.{where}",
        consumes=consumes,
        produces=produces,
        groups=groups,
        called_for=f"{_HERE}.{predicates}:{name.replace('-', '_')}",
    )
