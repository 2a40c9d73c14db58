"""Vibration of the skin along its normal while something slides over it."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray, Quantity, assumed
from tactbench.rigs.twin.contact.stages import READ_FROM_THE_SKIN, round_contact_mm, skin_under_load
from tactbench.rigs.twin.effects.friction import mode_of
from tactbench.rigs.twin.effects.roughness import Profile
from tactbench.rigs.twin.effects.skin_mode import shaken
from tactbench.rigs.twin.synthesis import Synthesis

LIFT: Quantity = assumed(
    0.03, "1", "a patch of a round finger that moves by x along it moves by x^2/(2 Ro) into it: x/Ro at 0.25 mm"
)
"""Normal over tangential motion of the skin, for sensors whose parameters state no ``skin_lift``."""


def apply(run: Synthesis) -> None:
    """Shake the skin on every clock that reads it: by the profile it slips over, and by stick-slip.

    The indenter is held where it stood when the slip began, so that the profile passing under the contact moves the
    skin, through its mode, and with it the normal force that is measured. The tangential motion of stick-slip (which
    has swung in that mode already) lifts the skin in proportion: dynamic pressure alone shows it, because the
    proportion is known for a motion and not for a place.
    """
    slide = run.scene.slide
    if slide is None or run.sliding is None:
        return
    mode = mode_of(run.sensor.spec)
    lift = run.sensor.spec.parameters.get("skin_lift", LIFT).to("1")
    profile, table = Profile(slide.surface, run.of_recording("roughness")), skin_under_load(run)

    def rough(t_s: FloatArray, force_n: FloatArray, slip_mm: FloatArray) -> FloatArray:
        radius = round_contact_mm(run, force_n)
        risen = profile.felt_mm(slip_mm, radius) - profile.felt_mm(np.zeros(slip_mm.size), radius)
        return shaken(t_s, np.where(force_n > 0, risen, 0.0), mode)

    for track in run.tracks:
        kinds = track.by_kind()
        if "ac_pressure" not in kinds and not kinds.keys() & set(READ_FROM_THE_SKIN):
            continue
        seen = run.sliding(track.t_s)
        track.vibration_mm = rough(track.t_s, track.force_n, seen.slip_mm)
        if "ac_pressure" in kinds:
            track.vibration_mm += np.where(track.force_n > 0, lift * seen.displacement_mm, 0.0)
    force_n = run.load.at(run.t_s)
    stiffness = table.per_mm(lambda force_n: force_n[:, None], force_n)[:, 0]
    run.reference_n += stiffness * rough(run.t_s, force_n, run.sliding(run.t_s).slip_mm)
