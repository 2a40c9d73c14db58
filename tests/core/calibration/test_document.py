"""docs/calibration.md and the priors it tells of say what the calibration that comes along says."""

from pathlib import Path

from tactbench.core.calibration.journal import decides_draws
from tactbench.core.calibration.result import load_result
from tactbench.core.calibration.summary import summary
from tactbench.core.calibration.tables import markdown
from tactbench.core.cli.config import default_calibration

DOCUMENT = Path(__file__).parents[3] / "docs" / "calibration.md"


def test_the_document_ends_with_the_tables_of_the_calibration_that_comes_along():
    result = load_result()
    # Made by: tactbench calibrate --show --format md
    said = markdown(result, summary(result))
    document = DOCUMENT.read_text(encoding="utf-8")
    assert document[document.index(f"## {result.spec.title}") :] == said


def test_it_was_drawn_by_the_procedure_that_comes_along():
    result = load_result()
    assert decides_draws(result.spec) == decides_draws(default_calibration())
    assert result.spec.model_dump(exclude={"draws"}) == default_calibration().model_dump(exclude={"draws"})


def test_every_prior_stands_in_the_document():
    text = DOCUMENT.read_text(encoding="utf-8")
    for nuisance in default_calibration().nuisances:
        bounds = f"{nuisance.prior.low:g} to {nuisance.prior.high:g}"
        assert bounds in text, f"{nuisance.name}: {bounds}"
