"""What is looked at beside the draws: one thing in several settings, the same seeds in each."""

import dataclasses
import math

import pytest

from tactbench.core.calibration.draw import Draw, parameters_of
from tactbench.core.calibration.placing import as_procedure, procedures
from tactbench.core.calibration.result import CalibrationResult, load_result, write_result
from tactbench.core.calibration.run import carry_out_variations
from tactbench.core.calibration.summary import summary
from tactbench.core.calibration.tables import markdown, text_tables
from tactbench.core.calibration.trial import Trial, checked, scenes_of
from tactbench.core.cli.config import default_calibration
from tactbench.core.errors import FormatError, UsageError
from tactbench.core.matrix.progress import Silence
from tactbench.plugin import load_registry
from tests.core.calibration.toy import draws, procedure

WIDTHS = (0.1, 0.5)
VARIATIONS = [
    {
        "name": "width", "title": "Some widths", "outputs": ["narrow"], "seeds": 5, "reason": "A test.",
        "settings": [
            {"label": f"width {value}", "given": [{"name": "placement_scatter_mm", "value": value}]}
            for value in WIDTHS
        ],
    },
]  # fmt: skip


def seeing(trial: Trial):
    """Answer with the given width and a little of the seed; the third seed fails."""
    seed, values = parameters_of(trial.spec, trial.seed, trial.number)
    if trial.number == 2:
        return Draw(trial.number, seed, values, {}, "failed", "two"), 0.1
    outputs = {output.name: values["given_1"] + 1e-12 * (seed % 7) for output in trial.spec.outputs}
    return Draw(trial.number, seed, values, outputs), 0.1


def refusing(trial: Trial):
    """Answer nothing: what is there already must not be asked for again."""
    raise AssertionError(trial)


def _varied(folder, work=seeing):
    spec = procedure(variations=VARIATIONS)
    return spec, carry_out_variations(spec, 5, folder, {"commit": "c"}, jobs=1, progress=Silence(), work=work)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    spec, varied = _varied(tmp_path_factory.mktemp("varied"))
    return CalibrationResult(spec, 5, tuple(draws(40, spec)), {"commit": "c"}, 90.0, varied=varied)


def test_settings_have_the_same_seeds_and_differ_by_what_they_give(result):
    first, second = result.varied["width"]
    assert [draw.seed for draw in first] == [draw.seed for draw in second]
    assert len({draw.seed for draw in first}) == 5
    for width, own in zip(WIDTHS, (first, second), strict=True):
        assert [draw.status for draw in own] == ["done", "done", "failed", "done", "done"]
        assert all(draw.outputs == {"narrow": pytest.approx(width)} for draw in own if draw.status == "done")


def test_what_was_carried_out_is_found_again(tmp_path):
    _, before = _varied(tmp_path)
    _, after = _varied(tmp_path, refusing)
    assert {name: [[d.outputs for d in own] for own in some] for name, some in after.items()} == {
        name: [[d.outputs for d in own] for own in some] for name, some in before.items()
    }


def test_a_changed_setting_is_another_procedure(tmp_path):
    _varied(tmp_path)
    other = [{**VARIATIONS[0], "settings": VARIATIONS[0]["settings"][::-1]}]
    spec = procedure(variations=other)
    with pytest.raises(UsageError, match="another procedure"):
        carry_out_variations(spec, 5, tmp_path, {}, jobs=1, progress=Silence(), work=seeing)


def test_they_are_written_and_read_back(result, tmp_path):
    write_result(result, tmp_path / "calibration")
    found = load_result(tmp_path)
    bare = {
        name: tuple(tuple(dataclasses.replace(draw, parameters={}) for draw in own) for own in settings)
        for name, settings in result.varied.items()
    }
    assert found.varied == bare
    assert [draw.reason for draw in found.varied["width"][0] if draw.status == "failed"] == ["two"]


@pytest.mark.parametrize(
    "line", ["width,3,0,1,done,,narrow,1.0", "height,1,0,1,done,,narrow,1.0", "width,1,0,1,odd,,,"]
)
def test_settings_that_are_none_are_refused(result, tmp_path, line):
    write_result(result, tmp_path / "calibration")
    path = tmp_path / "calibration" / "variations.csv"
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(FormatError, match="not a finished calibration"):
        load_result(tmp_path)


def _rows(table):
    return [dict(zip(table.columns, line, strict=True)) for line in table.lines]


def test_a_table_has_a_row_for_each_setting(result):
    (table,) = [one for one in text_tables(result, summary(result)) if one.title.startswith("Some widths")]
    assert [row["setting"] for row in _rows(table)] == ["width 0.1", "width 0.5"]
    assert [row["seeds"] for row in _rows(table)] == ["4", "4"]
    assert [row["narrow"] for row in _rows(table)] == ["0.1 (0.1 … 0.1)", "0.5 (0.5 … 0.5)"]
    without = dataclasses.replace(result, varied={})
    assert not [one for one in text_tables(without, summary(without)) if one.title.startswith("Some widths")]


def test_an_earlier_calibration_stands_beside(result, tmp_path):
    wider = procedure(nuisances=[
        {**one.model_dump(), "prior": {"kind": "uniform", "low": 0.0, "high": 2.0}} if one.name == "width"
        else one.model_dump()
        for one in procedure().nuisances
    ])  # fmt: skip
    earlier = CalibrationResult(wider, 5, tuple(draws(30, wider)), {"commit": "b"}, 60.0)
    write_result(result, tmp_path / "calibration")
    write_result(earlier, tmp_path / "calibration" / "earlier")
    found = load_result(tmp_path)
    assert found.earlier.draws == earlier.draws
    said = markdown(found, summary(found))
    (table,) = [one for one in text_tables(found, summary(found)) if one.title == "Beside the earlier 30 draws"]
    # Every published number and every finding, each by what its own draws say.
    assert [row["number or finding"] for row in _rows(table)] == ["narrow", "tall", "both", "tall exceeds both"]
    narrow = {name: summary(one).predictions[0].before.median for name, one in (("now", result), ("then", earlier))}
    assert _rows(table)[0]["prior"].startswith(f"{narrow['now']:.3g} (")
    assert _rows(table)[0]["earlier prior"].startswith(f"{narrow['then']:.3g} (")
    assert not math.isclose(narrow["now"], narrow["then"], rel_tol=0.05)
    assert "Priors that differ: width 0 to 2 then, 0 to 1 now." in said


def test_what_comes_along_is_checked_before_anything_is_simulated():
    spec = default_calibration()
    checked(spec)
    assert {variation.name for variation in spec.variations} == {"contact_place", "warmth"}
    wrong = spec.variations[0].model_dump()
    wrong["settings"][1]["given"][0]["name"] = "drive_delay_ms"
    with pytest.raises(UsageError, match="drive_delay_ms: the scene has no drive"):
        checked(type(spec).model_validate({**spec.model_dump(), "variations": [wrong]}))


def test_a_setting_moves_the_contact_and_leaves_all_else():
    spec, task = default_calibration(), load_registry().tasks["curvature"].spec
    moved = next(one for one in spec.variations if one.name == "contact_place").settings[-1]
    variation = spec.variations[0]
    own = as_procedure(spec, variation, moved)
    seed, values = parameters_of(own, spec.seed, 0)
    for planned in scenes_of(own, "icub", task, values, seed):
        placement = planned.scene.placement
        assert (placement.x.to("mm"), placement.s.to("mm")) == (-1.3, 1.9)
        declared = next(one.scene for one in task.scenes if one.scene.name == planned.scene.name)
        assert planned.scene.environment == declared.environment
        assert placement.scatter == declared.placement.scatter
    assert len(list(procedures(spec))) == sum(len(one.settings) for one in spec.variations)
