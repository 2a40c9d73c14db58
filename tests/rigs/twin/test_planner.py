from __future__ import annotations

import pytest

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import ForceRamp, NotApplicable, PluginContractError, RigContext, Scene, UsageError
from tactbench.plugin.simulation import EffectDescriptor, Slide
from tactbench.rigs.twin.planner import plan_scene
from tactbench.rigs.twin.rig import build
from tests.rigs.twin.conftest import EFFECTS, named, q


def _named(plan):
    return named(plan.entries)


def _effect(name, consumes, produces, predicate="converter", **more):
    return EffectDescriptor(
        name=name, title=name, where="x:y", consumes=consumes, produces=produces,
        called_for=f"tactbench.rigs.twin.effects.called_for:{predicate}", **more,
    )  # fmt: skip


def test_every_effect_has_one_entry_with_a_reason(specs):
    for spec in specs.values():
        plan = plan_scene(EFFECTS, Scene(name="s"), spec)
        assert sorted(entry.effect for entry in plan.entries) == sorted(effect.name for effect in EFFECTS)
        assert all(entry.reason for entry in plan.entries)


def test_what_changes_nothing_is_left_out(specs):
    held = ForceRamp(start=q(2, "N"), end=q(2, "N"))
    plan = _named(plan_scene(EFFECTS, Scene(name="held", profile=held), specs["icub"]))
    assert not plan["creep"].included
    assert not plan["core"].included
    idle = ForceRamp(end=q(0, "N"))
    plan = _named(plan_scene(EFFECTS, Scene(name="idle", profile=idle), specs["biotac"]))
    assert not plan["contact"].included
    assert not plan["core"].included


def test_an_effect_that_is_not_called_for_drags_nothing_along(specs):
    heir = _effect("heir", ("oil",), ("disturbance",), "friction")
    well = _effect("well", (), ("oil",))
    still = Scene(name="s")
    plan = _named(plan_scene([*EFFECTS, heir, well], still, specs["icub"]))
    assert (plan["heir"].included, plan["well"].included) == (False, False)
    assert plan["well"].reason == "no observed channel depends on it"
    sliding = still.model_copy(update={"slide": Slide(speed=q(5, "mm/s"))})
    plan = _named(plan_scene([*EFFECTS, heir, well], sliding, specs["icub"]))
    assert (plan["heir"].included, plan["well"].included) == (True, True)


def test_a_circle_of_effects_is_refused(specs):
    circle = [_effect("egg", ("hen",), ("egg", "taxel")), _effect("hen", ("egg",), ("hen",))]
    with pytest.raises(PluginContractError, match="circle"):
        plan_scene([*EFFECTS, *circle], Scene(name="s"), specs["icub"])


def test_a_predicate_that_answers_something_else_is_refused(specs):
    odd = EffectDescriptor(name="odd", title="odd", where="x:y", produces=("disturbance",), called_for="operator:is_")
    with pytest.raises(PluginContractError, match="not Reason"):
        plan_scene([*EFFECTS, odd], Scene(name="s"), specs["icub"])


def _asking(*words):
    return Scene(name="s", simulation=Simulation(effects=words))


def test_effects_are_included_and_left_out_as_asked(specs):
    plan = _named(plan_scene(EFFECTS, _asking("-drift", "+wander", "+fluid-pressure"), specs["biotac"]))
    assert not plan["warm-up"].included
    assert not plan["offset"].included
    assert plan["warm-up"].change is None, "what was called for and is left out has no bound any more"
    assert plan["wander"].included
    assert plan["fluid-pressure"].included
    assert {name for name, entry in plan.items() if entry.asked} == {"warm-up", "offset", "wander", "fluid-pressure"}
    assert _named(plan_scene(EFFECTS, _asking("-drift", "drift"), specs["biotac"]))["offset"].included
    assert all(entry.included for entry in plan_scene(EFFECTS, _asking("+all"), specs["icub"]).entries)


def test_an_effect_of_another_package_is_planned_only_where_it_is_named(sensors):
    other = _effect("other", (), ("disturbance",), groups=("drift",))
    twin = build(RigContext(effects=EFFECTS, named_effects=(other,)))
    icub = sensors["icub"]
    naming = icub.model_copy(update={"effects": ("other",)})
    for sensor, words, included in [
        (icub, (), None), (icub, ("+all", "-drift"), None), (icub, ("other",), True), (icub, ("-other",), False),
        (naming, (), True), (naming, ("-drift",), False),
    ]:  # fmt: skip
        entry = _named(twin.plan(sensor, _asking(*words))).get("other")
        assert (None if entry is None else entry.included) is included, words
    with pytest.raises(NotApplicable, match="elsewhere"):
        twin.plan(icub.model_copy(update={"effects": ("elsewhere",)}), _asking())


def test_a_word_that_is_no_effect_is_refused_with_what_there_is_and_so_is_leaving_out_what_is_observed(specs):
    with pytest.raises(UsageError, match="'fog'") as refused:
        plan_scene(EFFECTS, _asking("+fog"), specs["icub"])
    assert "creep" in refused.value.hint
    assert "drift" in refused.value.hint
    with pytest.raises(NotApplicable, match="without transduction"):
        plan_scene(EFFECTS, _asking("-transduction"), specs["icub"])
