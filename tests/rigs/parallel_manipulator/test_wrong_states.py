"""Presses in which the rig believes something plausible and wrong, in virtual time, with the true force logged."""

import re

import pytest

from tactbench.plugin import RigError
from tactbench.plugin.devices import ScenePhysics
from tactbench.rigs.parallel_manipulator.emulated_press import FORCE, PressEmulators
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.rig_check import check
from tests.rigs.parallel_manipulator.spring import SpringRig, file_of, pressed, ramp
from tests.rigs.parallel_manipulator.test_press import RARER

SCENE = ramp(5.0, 0.5, 8.0)
UNCHECKED = {"settings__press__check_n": None}
SETTLES = {"settings__force_loop__integral_mm_n_s": 0.4}
"""Also on 25 N/mm: k K = 10."""


class World:
    """What is true of force and place, and what is read.

    `reads` of the true force on the force sensor, the second, and the true force on the skin; `slip` of the position
    that the drive counts: how much deeper the indenter truly is.
    """

    def __init__(self, monkeypatch, reads=lambda force_n, t_s, skin_n: force_n, slip=lambda position_m: 0.0):
        self.largest_n, self.reads, self.slip = 0.0, reads, slip
        monkeypatch.setattr(PressEmulators, "_sensed", lambda emulators, t_s: self.sensed(emulators, t_s))
        monkeypatch.setattr(PressEmulators, "_force_n", lambda emulators, at_m: self.force_n(emulators, at_m))

    def force_n(self, emulators, position_m):
        return 0.0 if emulators.press is None else emulators.press.force_n(position_m + self.slip(position_m))

    def sensed(self, emulators, t_s):
        if emulators.press is None:
            return {}
        position_m = emulators._motor.position_m
        true_n = self.force_n(emulators, position_m)
        self.largest_n = max(self.largest_n, true_n)
        found = emulators.press.sensed(t_s, position_m + self.slip(position_m))
        noise_n = found[FORCE] - true_n
        return {**found, FORCE: self.reads(true_n + emulators.pushed_n, t_s, true_n) + noise_n}


class Frozen:
    """Answers no more from a true force on, or from a second on; its noise stays."""

    def __init__(self, from_n=float("inf"), from_s=float("inf")):
        self.from_n, self.from_s, self.held_n = from_n, from_s, None

    def __call__(self, force_n, t_s, skin_n):
        if self.held_n is None and (skin_n >= self.from_n or t_s >= self.from_s):
            self.held_n = force_n
        return force_n if self.held_n is None else self.held_n


def times(factor):
    return lambda force_n, t_s, skin_n: factor * force_n


def later(factor, from_n):
    """Return a sensor that reads so much from a true force on the skin on, as with a wire that breaks."""
    seen = []

    def reads(force_n, t_s, skin_n):
        seen.extend([1] if skin_n > from_n else [])
        return factor * force_n if seen else force_n

    return reads


def drifting(n_s, from_s):
    return lambda force_n, t_s, skin_n: force_n + n_s * max(0.0, t_s - from_s)


def loaded(newtons, until_s):
    """Return a sensor on which something rests until a second."""
    return lambda force_n, t_s, skin_n: force_n + (newtons if t_s < until_s else 0.0)


def loaded_until_touched(newtons):
    """Return a sensor on which something rests until the skin is touched."""
    touched = []

    def reads(force_n, t_s, skin_n):
        touched.extend([1] if skin_n > 0.0 else [])
        return force_n if touched else force_n + newtons

    return reads


def returning(lost_m):
    """Return a motor that loses its first steps on its way out of the depth of the ramp."""
    deepest = [-1.0]

    def slip(position_m):
        deepest[0] = max(deepest[0], position_m)
        return min(lost_m, deepest[0] - position_m) if deepest[0] > -0.5e-3 else 0.0

    return slip


CHECKED = "reads"
SCHEDULES = {
    # name: (stiffness [N/mm], what is wrong, changes of the rig file, what is said; empty: the press is complete)
    "sound, soft foam": (2.2, {}, {}, ""),
    "sound, hard skin": (25.0, {}, {}, ""),
    "sign turned": (5.0, {"reads": times(-1)}, {}, CHECKED),
    "kgf": (5.0, {"reads": times(1 / 9.80665)}, {}, CHECKED),
    "double": (5.0, {"reads": times(2.0)}, {}, CHECKED),
    "frozen before": (25.0, {"reads": Frozen(from_s=0.0)}, {}, CHECKED),
    "sign turned, unchecked": (25.0, {"reads": times(-1)}, UNCHECKED, "force ceiling"),
    "kgf, unchecked": (5.0, {"reads": times(1 / 9.80665)}, UNCHECKED, "no touch|softest"),
    "1e-4, unchecked": (25.0, {"reads": times(1e-4)}, UNCHECKED, "no touch"),
    "frozen after the check": (25.0, {"reads": Frozen(from_s=2.0)}, {}, "no touch"),
    "frozen in the ramp, hard": (25.0, {"reads": Frozen(from_n=3.0)}, {}, "softest"),
    "a third from 2 N on": (5.0, {"reads": later(0.3, 2.0)}, {}, "softest"),
    "zero falls": (5.0, {"reads": drifting(-0.2, 8.0)}, {}, "N are left|softest"),
    "zero rises": (5.0, {"reads": drifting(0.2, 8.0)}, {}, "N are left|stiffest"),
    "loaded while zeroed": (5.0, {"reads": loaded(2.4, 3.0)}, {}, "not arm"),
    "load that falls off at the touch": (5.0, {"reads": loaded_until_touched(2.4)}, {}, "no touch"),
    "pull that ends at the touch": (5.0, {"reads": loaded_until_touched(-2.4)}, {}, "N are left"),
    "0.3 mm deeper": (5.0, {"slip": lambda at_m: 0.3e-3}, {}, ""),
    "2.2 mm deeper, in the skin": (5.0, {"slip": lambda at_m: 2.2e-3}, {}, "before"),
    "3 mm deeper, in the skin": (5.0, {"slip": lambda at_m: 3e-3}, {}, "refused"),
    "3 mm less deep": (5.0, {"slip": lambda at_m: -3e-3}, {}, "no touch"),
    "steps lost on the way out": (5.0, {"slip": returning(3e-3)}, {}, "N are left"),
}


def run(monkeypatch, name):
    """Return the largest true force, the largest that `doctor` prints, and what was said."""
    stiffness, wrong, changes, _ = SCHEDULES[name]
    file = file_of(**(RARER | SETTLES | changes))
    world = World(monkeypatch, **wrong)
    rig = ParallelManipulator(file, None, ScenePhysics(SpringRig(stiffness)))
    try:
        said = pressed(rig, SCENE).acquisition.ended
    except RigError as error:
        said = error.message
    (_, forces) = check(file).tables
    bound_n = max(float(value.split()[0]) for what, value in forces.rows if " N" in value)
    return world.largest_n, bound_n, said


@pytest.mark.parametrize("name", SCHEDULES)
def test_the_true_force_stays_below_what_is_printed(monkeypatch, name):
    largest_n, bound_n, said = run(monkeypatch, name)
    assert largest_n <= bound_n
    expected = SCHEDULES[name][-1]
    assert re.search(expected, said) if expected else said == ""
