from __future__ import annotations

import pytest

from tactbench.plugin import EffectDescriptor, ForceRamp, PluginContractError, Scene, assumed
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.planner import plan_scene

EFFECTS = tactbench_effects()


def _named(plan):
    return {entry.effect: entry for entry in plan.entries}


def test_every_effect_has_one_entry_with_a_reason(specs):
    for spec in specs.values():
        plan = plan_scene(EFFECTS, Scene(name="s"), spec)
        assert sorted(entry.effect for entry in plan.entries) == sorted(effect.name for effect in EFFECTS)
        assert all(entry.reason for entry in plan.entries)


def test_producers_come_before_consumers_whatever_the_order_given(specs):
    for effects in (EFFECTS, EFFECTS[::-1]):
        names = [effect.name for effect in plan_scene(effects, Scene(name="s"), specs["biotac"]).stages]
        assert names.index("creep") < names.index("contact") < names.index("transduction") < names.index("converter")
        assert names.index("gain") < names.index("transduction")
        assert names.index("white-noise") < names.index("converter")


def test_what_changes_nothing_is_left_out(specs):
    held = ForceRamp(start=assumed(2, "N", "t"), end=assumed(2, "N", "t"))
    plan = _named(plan_scene(EFFECTS, Scene(name="held", profile=held), specs["icub"]))
    assert not plan["creep"].included
    assert "2 N" in plan["creep"].reason
    assert not plan["core"].included
    idle = ForceRamp(end=assumed(0, "N", "t"))
    plan = _named(plan_scene(EFFECTS, Scene(name="idle", profile=idle), specs["biotac"]))
    assert not plan["contact"].included
    assert not plan["core"].included


def test_a_circle_of_effects_is_refused(specs):
    def effect(name, consumes, produces):
        return EffectDescriptor(
            name=name, title=name, where="x:y", consumes=consumes, produces=produces,
            called_for="tactbench.rigs.twin.effects.called_for:converter",
        )  # fmt: skip

    circle = [effect("egg", ("hen",), ("egg", "taxel")), effect("hen", ("egg",), ("hen",))]
    with pytest.raises(PluginContractError, match="circle"):
        plan_scene([*EFFECTS, *circle], Scene(name="s"), specs["icub"])


def test_a_predicate_that_answers_something_else_is_refused(specs):
    odd = EffectDescriptor(name="odd", title="odd", where="x:y", produces=("disturbance",), called_for="operator:is_")
    with pytest.raises(PluginContractError, match="not Reason"):
        plan_scene([*EFFECTS, odd], Scene(name="s"), specs["icub"])
