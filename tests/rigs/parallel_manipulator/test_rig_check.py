"""What a rig file is refused for, with the line or the reason, and what is said of one that is not."""

import re

import pytest
import yaml

from tactbench.core.cli import main
from tactbench.plugin import RigContext, UsageError, load_registry
from tactbench.plugin.devices import RigFile
from tactbench.rigs.parallel_manipulator.rig import build
from tactbench.rigs.parallel_manipulator.rig_check import check
from tactbench.rigs.parallel_manipulator.settings import settings_of, with_limits
from tests.rigs.parallel_manipulator.spring import EXAMPLE, example, file_of, with_joints


def run(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


def written(tmp_path, said):
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(said, sort_keys=False), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["emulated.yaml", "fixed.yaml"])
def test_the_examples_are_not_refused_and_nothing_moves(capsys, name):
    code, out, _ = run(["doctor", "--seconds", "0", "--rig-file", str(EXAMPLE.with_name(name))], capsys)
    assert code == 0
    for text in ("24.7 N", "Nothing was opened", "share of the largest", "reaction", "holds without power", "ASSUMED"):
        assert text in out


def test_a_file_without_a_ceiling_is_refused_with_its_line(tmp_path, capsys):
    path = written(tmp_path, example(settings__limits__force_ceiling_n=...))
    line = next(n for n, text in enumerate(path.read_text().splitlines(), start=1) if text.strip() == "limits:")
    code, _, err = run(["doctor", "--seconds", "0", "--rig-file", str(path)], capsys)
    assert code == 2
    assert f"rig.yaml:{line}: the key 'force_ceiling_n' is missing" in err


def problems(**changes):
    return check(RigFile.model_validate(example(**changes))).problems


def test_gains_above_half_of_the_limit_are_refused(capsys):
    (problem,) = problems(settings__force_loop__integral_mm_n_s=1.2)
    assert "0.67 of those that no longer settle" in problem


def test_forces_above_the_rating_are_refused():
    found = problems(settings__limits__rated_force_n=8.5)
    assert any("the weakest part is rated for 8.50 N" in text for text in found)


def test_a_quick_touch_is_refused():
    # 80 N/mm at 5 mm/s: several newtons.
    stiff = {"settings__stiffness__at_touch_n_mm": 80.0, "settings__stiffness__greatest_n_mm": 80.0}
    found = problems(
        settings__touch__touch_speed_mm_s=5.0, settings__touch__allowed_n=1.0,
        settings__force_loop__integral_mm_n_s=0.2, **stiff,
    )  # fmt: skip
    assert any("The first touch may come to" in text for text in found)


def test_a_speed_that_the_drive_does_not_have_is_refused():
    found = problems(devices__motor__options__speed_unit_m_s=1e-3)
    assert any("no speed of 0.0005" in text for text in found)


def test_a_slow_line_is_refused_for_a_quick_loop():
    found = problems(devices__motor__options__baud=9600)
    assert any("One increment takes" in text for text in found)


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("corridor_m", ..., "motor lack corridor_m"),
        ("force_constant_n_a", ..., "motor lack peak_force_n"),
        ("orientation", ..., "motor lack orientation"),
        ("brake", ..., "motor lack brake"),
        ("counterweight", ..., "motor lack counterweight"),
        # 12 A at 6.5 N/A on a sensor for 25 N.
        ("peak_current_a", 12.0, r"78\.0 N, and the weakest part bears 25 N"),
    ],
)
def test_an_axis_says_what_would_make_it_unsafe(option, value, said):
    (problem,) = problems(**{f"devices__motor__options__{option}": value})
    assert re.search(said, problem)


def rails(**options):
    """Return what is found of the example with its rails, whose options are changed."""
    changes = {f"devices__joint-{n}__options__{name}": value for n in (1, 2, 3) for name, value in options.items()}
    file = with_joints(**{f"devices__joint-{n}__options__speed_m_s": 0.0018 for n in (1, 2, 3)}, **changes)
    return check(RigFile.model_validate(file))


def test_rails_are_held_against_the_rated_force_alone_and_together():
    sound = rails()
    assert sound.problems == ()
    rows = {row[0]: row for row in sound.tables[0].rows}
    # Vertical rails, in their middle: 3 x 1.2 A x 6.5 N/A along z.
    assert rows["joint-1, joint-2, joint-3"][2:4] == ("23.4 N", "sent current limit, 1.2 A")
    found = rails(peak_current_a=1.6).problems
    assert [text for text in found if "joint-1, joint-2, joint-3 together can exert 31.2 N" in text] == list(found)
    assert any("joint-2's drive can exert 78.0 N" in text for text in rails(peak_current_a=12.0).problems)


def test_a_force_beyond_any_current_is_refused_with_both_numbers():
    with pytest.raises(UsageError, match=r"no current of 76\.9.*500\.0 N, and the weakest part bears 25 N"):
        rails(peak_current_a=..., peak_force_n=500.0)


def test_a_declared_force_is_sent_as_a_current_or_refused():
    assert rails(peak_current_a=..., peak_force_n=7.8).problems == ()
    found = rails(peak_current_a=..., force_constant_n_a=..., peak_force_n=7.8).problems
    assert len(found) == 3
    assert all("sent no limit for the declared force" in text for text in found)


def test_a_horizontal_axis_needs_no_brake():
    stated = {"orientation": "horizontal", "brake": ..., "counterweight": ...}
    assert problems(**{f"devices__motor__options__{name}": value for name, value in stated.items()}) == ()


def test_an_axis_that_is_homed_towards_the_skin_is_refused():
    options = {"homing": "end-stop", "homing_speed_m_s": 0.005}
    found = problems(**{f"devices__motor__options__{name}": value for name, value in options.items()})
    assert any("homed towards the skin" in text for text in found)
    file = with_joints(**{f"devices__joint-2__options__{name}": value for name, value in options.items()})
    assert check(RigFile.model_validate(file)).problems == ()
    options["homing_speed_m_s"] = -0.005
    file = with_joints(**{f"devices__joint-2__options__{name}": value for name, value in options.items()})
    assert any("joint-2 is homed downwards" in text for text in check(RigFile.model_validate(file)).problems)


def test_the_way_until_a_dead_force_is_noticed_is_of_the_softest_skin():
    def way_mm(softest_n_mm):
        (_, forces) = check(file_of(settings__stiffness__softest_n_mm=softest_n_mm)).tables
        return float(dict(forces.rows)["where the force sensor ceases to answer"].split()[-2])

    # Twice the tolerance of 0.4 mm, the way to a mean of 0.1 N, and 0.5 mm/s for the 20 ms of a mean.
    assert way_mm(2.0) == pytest.approx(0.86, abs=0.005)
    # On the ramp twice that way, and 0.5 mm/s for the 20 ms of a mean.
    assert way_mm(0.1) == pytest.approx(2.01, abs=0.005)


def test_forces_are_computed_with_the_age_that_the_force_may_have():
    def of_an_approach(age_ms):
        (_, forces) = check(file_of(settings__limits__force_age_ms=age_ms)).tables
        return float(dict(forces.rows)["in an approach that misses the touch"].split()[0])

    # 0.5 mm/s on 90 N/mm for 100 ms more; printed to 0.01 N.
    assert of_an_approach(130.0) - of_an_approach(30.0) == pytest.approx(4.5, abs=0.02)


def test_limits_are_stated_once():
    file = file_of(devices__motor__options__upper_m=0.004)
    with pytest.raises(UsageError, match="upper_m is stated among"):
        with_limits(file, settings_of(file), load_registry())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"settings__limits__heartbeat_ms": 30.0}, "heartbeat do not rise in this order: 60, 30"),
        ({"settings__limits__travel_mm": [-4.0, 2.0]}, "and the motor's travel do not rise"),
        ({"settings__limits__retreat_mm": -5.0}, "place of retreat do not rise"),
        ({"settings__limits__rated_force_n": 7.0}, "do not rise in this order"),
        ({"settings__touch__single_n": 9.0}, "the ceiling do not rise"),
        ({"settings__heights__stand_off_mm": 0.3}, "tolerance, stand-off and clearance do not rise"),
        ({"settings__stiffness__at_touch_n_mm": 30.0}, "rise in this order"),
        ({"settings__stiffness__softest_n_mm": 0.02}, "and the depth do not rise"),
        ({"force": ...}, "has no force"),
    ],
)
def test_contradictions_are_refused(changes, said):
    with pytest.raises(UsageError, match=said):
        settings_of(RigFile.model_validate(example(**changes)))


def test_a_delta_without_joints_is_refused():
    with pytest.raises(UsageError, match="no joint-1, joint-2, joint-3"):
        settings_of(RigFile.model_validate(example(settings__manipulator=with_joints()["settings"]["manipulator"])))


def test_places_out_of_the_workspace_are_refused_before_anything_moves():
    file = RigFile.model_validate(with_joints(settings__places__reach_x_mm=[-200.0, 200.0]))
    assert any("is not permitted" in text for text in check(file).problems)
    with pytest.raises(UsageError, match="is not permitted"):
        build(RigContext(rig_file=file))
