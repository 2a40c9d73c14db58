"""Which rig files are refused, with the line or value that is wrong, and the forces computed for others."""

import pytest
import yaml

from tactbench.core.cli import main
from tactbench.plugin import RigContext, UsageError, load_registry
from tactbench.plugin.devices import RigFile
from tactbench.rigs.parallel_manipulator.rig import build
from tactbench.rigs.parallel_manipulator.rig_check import check
from tactbench.rigs.parallel_manipulator.settings import with_limits
from tests.rigs.parallel_manipulator.spring import EXAMPLE, example, file_of, with_joints


def doctor(path, capsys):
    """Return the exit code and all that is printed."""
    with pytest.raises(SystemExit) as ended:
        main(["doctor", "--seconds", "0", "--rig-file", str(path)])
    captured = capsys.readouterr()
    return ended.value.code, captured.out + captured.err


@pytest.mark.parametrize("name", ["emulated.yaml", "fixed.yaml"])
def test_the_examples_are_not_refused_and_nothing_moves(capsys, name):
    code, out = doctor(EXAMPLE.with_name(name), capsys)
    assert code == 0
    for text in ("24.7 N", "reaction", "without power", "ASSUMED"):
        assert text in out


def test_a_file_without_a_ceiling_is_refused_with_its_line(tmp_path, capsys):
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(example(settings__limits__force_ceiling_n=...), sort_keys=False), encoding="utf-8")
    line = next(n for n, text in enumerate(path.read_text().splitlines(), start=1) if text.strip() == "limits:")
    code, out = doctor(path, capsys)
    assert code == 2
    assert f"rig.yaml:{line}:" in out
    assert "'force_ceiling_n'" in out


def of(part, **options):
    """Return changes of the example, all below one of its parts."""
    return {f"{part}__{name}": value for name, value in options.items()}


MOTOR = "devices__motor__options"
HORIZONTAL = {"orientation": "horizontal", "brake": ..., "counterweight": ...}
STIFF = of("settings__stiffness", at_touch_n_mm=80.0, greatest_n_mm=80.0)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (of("settings__force_loop", integral_mm_n_s=1.2), ["0.67"]),
        (of("settings__limits", rated_force_n=8.5), ["drive", "8.50"]),
        # 80 N/mm at 5 mm/s: several newtons.
        (
            of("settings__touch", touch_speed_mm_s=5.0, allowed_n=1.0)
            | of("settings__force_loop", integral_mm_n_s=0.2)
            | STIFF,
            ["touch_speed_mm_s"],
        ),
        (of(MOTOR, baud=9600), ["delay_ms"]),
        (of(MOTOR, corridor_m=...), ["corridor_m"]),
        (of(MOTOR, force_constant_n_a=...), ["peak_force_n"]),
        (of(MOTOR, orientation=...), ["orientation"]),
        (of(MOTOR, brake=...), ["brake"]),
        (of(MOTOR, counterweight=...), ["counterweight"]),
        # 12 A at 6.5 N/A on a sensor for 25 N.
        (of(MOTOR, peak_current_a=12.0), ["78.0 N"]),
        (of(MOTOR, homing="end-stop", homing_speed_m_s=0.005), ["homing_speed_m_s"]),
        (of(MOTOR, **HORIZONTAL), []),
    ],
)
def test_each_problem_names_what_is_wrong(changes, named):
    found = check(file_of(**changes)).problems
    assert len(found) == len(named)
    for problem, text in zip(found, named, strict=True):
        assert text in problem


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
    assert rows["joint-1, joint-2, joint-3"][2] == "23.4 N"
    (problem,) = rails(peak_current_a=1.6).problems
    assert "31.2 N" in problem
    assert sum("78.0 N" in problem for problem in rails(peak_current_a=12.0).problems) == 3
    with pytest.raises(UsageError, match=r"76\.9.*500\.0 N"):
        rails(peak_current_a=..., peak_force_n=500.0)


def test_a_declared_force_is_sent_as_a_current_or_refused():
    assert rails(peak_current_a=..., peak_force_n=7.8).problems == ()
    with pytest.raises(UsageError, match="force_constant_n_a"):
        rails(peak_current_a=..., force_constant_n_a=..., peak_force_n=7.8)


def test_a_speed_that_the_drive_does_not_have_is_refused():
    with pytest.raises(UsageError, match=r"0\.0005"):
        check(file_of(**of(MOTOR, speed_unit_m_s=1e-3)))


@pytest.mark.parametrize("speed_m_s", [0.005, -0.005])
def test_a_rail_is_homed_away_from_the_skin(speed_m_s):
    file = with_joints(**of("devices__joint-2__options", homing="end-stop", homing_speed_m_s=speed_m_s))
    assert len(check(RigFile.model_validate(file)).problems) == (speed_m_s < 0)


def printed(what, **changes):
    """Return the words of a row of the table of forces."""
    (_, forces) = check(file_of(**changes)).tables
    (row,) = [value for name, value in forces.rows if what in name]
    return row.split()


@pytest.mark.parametrize(("softest_n_mm", "way_mm"), [(2.0, 0.86), (0.1, 2.01)])
def test_the_way_until_a_dead_force_is_noticed_is_of_the_softest_skin(softest_n_mm, way_mm):
    # Twice the tolerance of 0.4 mm, the way to a mean of 0.1 N, and 0.5 mm/s for the 20 ms of a mean.
    # On the ramp twice that way, and 0.5 mm/s for the 20 ms of a mean.
    found = printed("stops responding", settings__stiffness__softest_n_mm=softest_n_mm)[-2]
    assert float(found) == pytest.approx(way_mm, abs=0.005)


def test_forces_are_computed_with_the_age_that_the_force_may_have():
    late, soon = (float(printed("approach", settings__limits__force_age_ms=age_ms)[0]) for age_ms in (130.0, 30.0))
    # 0.5 mm/s on 90 N/mm for 100 ms more; printed to 0.01 N.
    assert late - soon == pytest.approx(4.5, abs=0.02)


def test_limits_are_stated_once():
    file = file_of(devices__motor__options__upper_m=0.004)
    with pytest.raises(UsageError, match="upper_m"):
        with_limits(file, load_registry())


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (of("settings__limits", heartbeat_ms=30.0), "60, 30"),
        (of("settings__limits", travel_mm=[-4.0, 2.0]), "retreat"),
        (of("settings__limits", retreat_mm=-5.0), "retreat"),
        (of("settings__limits", travel_ceiling_n=9.0), "travel_ceiling_n"),
        (of("settings__limits", rated_force_n=7.0), "rated"),
        (of("settings__touch", single_n=9.0), "ceiling"),
        (of("settings__heights", stand_off_mm=0.3), "tolerance"),
        (of("settings__heights", clearance_mm=1.0), "clearance"),
        (of("settings__stiffness", at_touch_n_mm=30.0), "greatest_n_mm"),
        (of("settings__stiffness", softest_n_mm=0.02), "depth"),
        ({"force": ...}, "force"),
        ({"settings__manipulator": with_joints()["settings"]["manipulator"]}, "joint-1"),
    ],
)
def test_contradictions_are_refused(changes, named):
    with pytest.raises(UsageError, match=named):
        with_limits(file_of(**changes), load_registry())


def test_places_out_of_the_workspace_are_refused_before_anything_moves():
    file = RigFile.model_validate(with_joints(settings__places__reach_x_mm=[-200.0, 200.0]))
    (problem,) = check(file).problems
    assert "leg" in problem
    with pytest.raises(UsageError, match="leg"):
        build(RigContext(rig_file=file))
