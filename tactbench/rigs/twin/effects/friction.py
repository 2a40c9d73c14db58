"""Effect of friction between a sliding surface and the skin."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import ChannelSpec, Quantity, SensorSpec, assumed, derived
from tactbench.rigs.twin.contact.stages import round_contact_mm
from tactbench.rigs.twin.contact.tangential import shear_modulus_mpa, sliding_stiffness
from tactbench.rigs.twin.effects.stick_slip import Dragged, Drive, Mode
from tactbench.rigs.twin.synthesis import Synthesis

GRID_HZ = 500.0
"""Rate of the nodes between which load and stiffness are interpolated; both change over seconds."""
MODE: dict[str, Quantity] = {
    "skin_mode_frequency": derived(
        330.0, "Hz", "Fishel and Loeb 2012: a BioTac feels the smallest vibrations near 330 Hz"
    ),
    "skin_mode_damping": assumed(0.1, "1", "share of the critical damping; no source for any of these skins"),
}
"""Parameters of the skin's tangential oscillation, for sensors whose parameters state none."""


def mode_of(sensor: SensorSpec) -> Mode:
    """Return the tangential oscillation (frequency and damping) of a sensor's skin under a contact."""
    found = {**MODE, **sensor.parameters}
    return Mode(2.0 * math.pi * found["skin_mode_frequency"].to("Hz"), found["skin_mode_damping"].to("1"))


def apply(run: Synthesis) -> None:
    """Compute the motion of a dragged skin, and record tangential force and true slip beside the reference force.

    The force sensor's stream gains ``fx`` and ``fy`` (force on the sensor, along x and s), ``slip`` (how far the
    surface has slipped over the skin under it, in metres), ``slipping`` (1 while the whole contact slips) and
    ``stick_ratio``.
    """
    slide = run.scene.slide
    if slide is None or not run.load.largest_n > 0:
        return
    surface, mode = slide.surface, mode_of(run.sensor.spec)
    duration = run.scene.profile.duration.to("s")
    grid = np.linspace(0.0, duration, max(2, math.ceil(duration * GRID_HZ) + 1))
    load = run.load.at(grid)
    radius = round_contact_mm(run, load)
    start = slide.start.to("s")
    drive = Drive(
        speed_mm_s=slide.speed.to("mm/s"),
        start_s=start,
        end_s=math.inf if slide.duration is None else start + slide.duration.to("s"),
        static=surface.static_friction.to("1"),
        kinetic=surface.kinetic_friction.to("1"),
        stribeck_mm_s=surface.stribeck_speed.to("mm/s"),
        mode=mode,
        t_s=grid,
        load_n=load,
        stiffness=sliding_stiffness(radius, shear_modulus_mpa(run.skin)),
    )
    dragged = Dragged(drive)
    run.sliding = dragged
    seen = dragged(run.t_s)
    angle = slide.direction.to("rad")
    for name, share in (("fx", math.cos(angle)), ("fy", math.sin(angle))):
        run.reference_more[name] = (ChannelSpec(name=name, kind="force", unit="N"), share * seen.force_n)
    run.reference_more["slip"] = (ChannelSpec(name="slip", kind="position", unit="m"), 1e-3 * seen.slip_mm)
    for name, values in (("slipping", seen.slipping.astype(np.float64)), ("stick_ratio", seen.stick_ratio)):
        run.reference_more[name] = (ChannelSpec(name=name, kind="other", unit="1", lower=0.0, upper=1.0), values)
    run.drawn["slips"] = int(dragged.let_go_s.size)
