"""Checks of what takes part in a simulated scene: effects, shapes of indenters, force profiles."""

from __future__ import annotations

from typing import get_args

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import WHY, differing, presses, simulated_sensors, tiny_scene
from tactbench.core.conformance.streams import FORCE_SHARE, Recorded, pressing_force
from tactbench.core.errors import nearest
from tactbench.core.plugins.force_profiles import force_path
from tactbench.core.plugins.interfaces import Reason
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Indenter, Scene, Simulation, Slide
from tactbench.core.spec.sensor import ChannelKind

ALWAYS_WANTED = ("stored", "reference-force")
"""What every recording needs, beside the kinds of channels that are observed."""
REACH_MM = 15.0
"""Half of the side of the plane over which heights are looked at: no skin here is wider."""
LOWEST_MM = 1e-9
"""By which the lowest point may miss 0: rounding of millimetres, and nothing that a skin feels."""
MOST_N = 100.0
"""Beyond the rated range of every tactile sensor of a finger."""


def _pressed(subject: Subject) -> Recorded:
    """Return a tiny press with the effect asked for by name, and those of its distribution that it consumes.

    It is pressed plainly, under force control, warmer than the sensor, or sliding: as first calls for the effect.
    """
    siblings = (one for one in subject.registry.effects.all_owned() if one.distribution == subject.distribution)
    words = [one.descriptor.name for one in siblings if set(subject.descriptor.consumes) & set(one.descriptor.produces)]
    sensors = simulated_sensors(subject)
    plain = tiny_scene(
        observe=tuple(dict.fromkeys(one.kind for sensor in sensors for one in sensor.spec.channels())),
        simulation=Simulation(effects=(*words, f"+{subject.name}")),
    )
    warm = plain.environment.model_copy(update={"indenter_temperature": assumed(40.0, "degC", WHY)})
    slide = Slide(speed=assumed(10.0, "mm/s", WHY), start=assumed(0.5, "s", WHY))
    more: tuple[dict[str, object], ...] = ({}, {"drive": ForceLoop()}, {"environment": warm}, {"slide": slide})

    def calls(scene: Scene) -> bool:
        with code_of("called_for", subject):
            reasons = [subject.code("called_for")(scene, sensor.spec) for sensor in sensors]
        for reason in reasons:
            if not isinstance(reason, Reason) or not reason.text:
                fail("called_for", f"it returned {reason!r}, and a Reason(called_for, text, change) is needed")
        return any(reason.called_for for reason in reasons)

    scenes = sorted((plain.model_copy(update=update) for update in more), key=calls, reverse=True)
    found = next(presses(subject, scenes, "where"), None)
    return skip("no simulated sensor and scene go with it") if found is None else found


@check("effect", needs="code-names-resolve")
def it_is_applied(subject: Subject) -> None:
    """An effect changes a recording in the making: one NaN ends every cell, one draw elsewhere is never repeated.

    Return a Reason with a text from called_for(scene, sensor); produce what an effect or channel needs; let `where`
    name a function of one argument, the synthesis, that changes it in place; guard divisions; draw from
    run.of_recording(…), run.of_session(…) or run.of_unit(…).
    """
    produced = subject.descriptor.produces
    consumed = {token for one in subject.registry.effects for token in one.consumes}
    wanted = {*get_args(ChannelKind), *ALWAYS_WANTED, *consumed}
    if not wanted.intersection(produced):
        close = nearest(produced[0], wanted) if produced else []
        fail(f"produces{list(produced)}", f"nothing needs it{f'; did you mean {close[0]}?' if close else ''}")
    made = _pressed(subject)
    (entry,) = [one for one in made.meta.plan if one.effect == subject.name]
    if not (entry.included or entry.asked):  # the solve may leave out what it was lent and did not need
        fail("produces", "it was asked for by name, and the plan left it out: nothing needs what it produces")
    changed = differing(made, _pressed(subject))
    if changed:
        fail(f"where: {changed[0]}", "another press with the same seed gives other samples")


@check("indenter", needs="code-names-resolve")
def indenter_is_pressed(subject: Subject) -> None:
    """A height is asked for at all places at once and counted from the lowest point, which touches first.

    Return one finite height [mm] for each pair of x_mm and y_mm, 0 at (0, 0) and nowhere below, 50 mm or more where no
    body is; choose defaults with flanks of up to 45 degrees.
    """
    line = np.linspace(-REACH_MM, REACH_MM, 61)
    numbers = subject.descriptor.dimensions
    with code_of("where", subject):
        sizes = {name: one.default for name, one in numbers.items()}
        found = np.asarray(subject.code("where")(line[:, None], line[None, :], **sizes))
    if found.shape != (61, 61) or not np.isfinite(found).all():
        fail("where", f"for places of shapes (61, 1) and (1, 61) it returned shape {found.shape}, or no finite heights")
    if abs(found[30, 30]) > LOWEST_MM or found.min() < -LOWEST_MM:
        fail("where", f"it is {found[30, 30]:g} mm high at (0, 0), at least {found.min():g} mm: 0 is needed")
    units = {name: assumed(one.default, one.unit, WHY) for name, one in numbers.items()}
    scene = tiny_scene(indenter=Indenter(shape=subject.name, dimensions=units))
    next(presses(subject, (scene,), "where"))


@check("profile", needs="code-names-resolve")
def path_is_recorded(subject: Subject) -> None:
    """A recording is tared on its own unloaded hold, and has as many samples of the force as the path says.

    Begin with a hold at 0 N, state newtons (a gram-force is 0.0098 N), and give samples enough for each piece.
    """
    with code_of("where", subject):
        path = force_path(subject.descriptor, {}, WHY)
    if path.forces_n[0] != 0 or not path.hold_s > 0:
        fail("where", f"it begins at {path.forces_n[0]:g} N with {path.hold_s:g} s of hold: none is left to tare on")
    if path.largest_n > MOST_N:
        fail("where", f"its largest force is {path.largest_n:g} N by default: are these gram-force?")
    made = next(presses(subject, (tiny_scene(profile=path),), "where"))
    recorded = float(pressing_force(made.came, made.meta.reference)[1].max())
    if abs(recorded - path.largest_n) > FORCE_SHARE * path.largest_n:
        fail("where", f"its {path.samples} samples reach {recorded:.3g} N, and the path {path.largest_n:g} N")
