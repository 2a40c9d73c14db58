"""docs/parameters.md says what the specs say."""

from pathlib import Path

from tactbench.core.report.datasheet import parameters_markdown
from tactbench.plugin import load_registry

DOCUMENT = Path(__file__).parents[3] / "docs" / "parameters.md"


def test_every_parameter_of_the_twin_stands_in_the_document_with_its_source():
    registry = load_registry()
    said = parameters_markdown([registry.sensors[name].spec for name in ("biotac", "icub", "ideal")])
    document = DOCUMENT.read_text(encoding="utf-8")
    # Made by: tactbench show biotac icub ideal --format md
    assert document[document.index("## ") :] == said
    assert said.count("| assumed |") > 10
