"""Vibration of the skin along its normal while something slides over it."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import Quantity, assumed
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.effects.friction import mode_of
from tactbench.rigs.twin.effects.roughness import Profile
from tactbench.rigs.twin.effects.skin_mode import shaken
from tactbench.rigs.twin.synthesis import Synthesis

LIFT: Quantity = assumed(
    0.03, "1", "a patch of a round finger that moves by x along it moves by x^2/(2 Ro) into it: x/Ro at 0.25 mm"
)
"""Normal over tangential motion of the skin, for sensors whose parameters state no ``skin_lift``."""


def apply(run: Synthesis) -> None:
    """Shake the skin on every clock that is fast enough to see it: by the profile it slips over, and by stick-slip.

    The indenter is held, so that the profile under the contact moves the skin, through its mode. The tangential motion
    of stick-slip (which has swung in that mode already) lifts the skin in proportion.
    """
    slide = run.scene.slide
    if slide is None or run.sliding is None:
        return
    mode = mode_of(run.sensor.spec)
    lift = run.sensor.spec.parameters.get("skin_lift", LIFT).to("1")
    profile = Profile(slide.surface, run.of_recording("roughness"))
    for track in run.tracks:
        if "ac_pressure" not in track.by_kind():
            continue
        seen = run.sliding(track.t_s)
        radius = skin_under_load(run).skin(track.force_n).contact_radius_mm
        height = profile.felt_mm(seen.slip_mm, radius)
        touched = track.force_n > 0
        rough = shaken(track.t_s, np.where(touched, height, 0.0), mode)
        track.vibration_mm = rough + np.where(touched, lift * seen.displacement_mm, 0.0)
    waves = profile.wave_mm
    run.drawn.update(roughness_shortest_mm=float(waves.min()), roughness_longest_mm=float(waves.max()))
