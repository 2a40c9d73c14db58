"""docs/estimators.md names every rung, and the numbers it states are the descriptors'."""

from pathlib import Path

from tactbench.estimators import tactbench_estimators

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")
BY_NAME = {descriptor.name: descriptor for descriptor in tactbench_estimators()}
SAID = {"regression": "number", "classification": "class", "events": "event"}


def line(name):
    return next(line for line in TEXT.splitlines() if line.startswith("|") and f"`{name}`" in line.split("|")[1])


def test_every_rung_has_its_line_and_is_said_to_answer_what_it_answers():
    for name, descriptor in BY_NAME.items():
        said = "both" if len(descriptor.kinds) == 2 else SAID[descriptor.kinds[0]]
        assert line(name).split("|")[2].strip() == said
