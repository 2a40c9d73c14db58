"""A plugin that is merely installed changes no recording and no key."""

import h5py
import numpy as np
import pytest

from tactbench.core.errors import RigError, UsageError
from tactbench.core.plugins.registry import Owned, Registry, installed
from tactbench.core.plugins.rigs import failing_as, load_rig_file, rig_context
from tactbench.core.spec.rig import EffectDescriptor
from tests.conftest import Verbs


@pytest.mark.parametrize(
    ("raised", "expected"),
    [(ValueError("boom"), RigError), (SystemExit("boom"), RigError), (UsageError("boom", hint=""), UsageError)],
)
def test_what_code_of_a_rig_raises_is_an_error_of_the_rig_unless_it_is_one_of_ours(raised, expected):
    with pytest.raises(expected, match="boom"), failing_as("It could not be built"):
        raise raised


@pytest.mark.parametrize(("stated", "physics"), [("", "twin"), ("emulation: {physics: other}", "other")])
def test_emulated_devices_of_a_rig_file_sense_the_simulated_rig_unless_it_states_another(tmp_path, stated, physics):
    path = tmp_path / "rig.yaml"
    path.write_text(f"rig: bench\nsensors: {{icub: {{link: emulated}}}}\n{stated}\n", encoding="utf-8")
    assert load_rig_file(path, installed()).emulation.physics == physics


def test_effects_of_other_packages_are_candidates_by_name_only():
    registry = Registry()
    for name, module in (("own", "tactbench.rigs.made"), ("foreign", "acme")):
        effect = EffectDescriptor(name=name, title=name, where="a:b", called_for="a:b")
        registry.effects.add(Owned(effect, module, "made", "1"))
    context = rig_context(registry)
    assert [[one.name for one in several] for several in (context.effects, context.named_effects)] == [
        ["own"], ["foreign"],
    ]  # fmt: skip


def recordings(verbs, out, *more, plugins=("patching",)):
    """Return the readings of a run's recordings, by the names of the files, which hold the keys."""
    asked = ("run", "--sensor", "icub", *more, "--task", "force", "--estimator", "mean", "--repeats", "1")
    verbs(*asked, "--out", out, plugins=plugins)
    found = {}
    for path in sorted((verbs.folder / out / "recordings").rglob("*.h5")):
        with h5py.File(path) as file:
            found[path.name] = file["streams/taxels/data"][:]
    return found


@pytest.fixture(scope="module")
def without(tmp_path_factory):
    """Recordings of a run without the plugin."""
    return recordings(Verbs(tmp_path_factory.mktemp("without")), "without", plugins=())


def test_an_effect_that_changes_numpy_when_it_is_imported_does_so_only_where_it_is_named(verbs, without):
    unnamed = recordings(verbs, "unnamed")
    assert without.keys() == unnamed.keys()
    assert all(np.array_equal(without[name], unnamed[name]) for name in without)
    named = recordings(verbs, "named", "--effects", "patching")
    assert named.keys().isdisjoint(without)
    assert all(not np.array_equal(a, b) for a, b in zip(named.values(), without.values(), strict=True))


@pytest.mark.parametrize(("doors", "engine"), [(("effect", "indenter"), "isolated"), (("indenter",), "in-process")])
def test_what_other_tasks_of_the_run_name_changes_no_recording_of_a_scene_that_does_not(
    request, without, doors, engine
):
    tasks = [word for door in doors for word in ("--task", f"patching-{door}")]
    command = request.getfixturevalue("verbs" if engine == "isolated" else "shell")
    beside = recordings(command, "beside", *tasks, "--jobs", "1", "--engine", engine)
    assert len(beside) == len(without) + 2 * len(doors)
    assert all(np.array_equal(without[name], beside[name]) for name in without)
