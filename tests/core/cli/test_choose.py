"""The verb ``choose``, and the pages of ``show``: read by people on narrow terminals, and by programs."""

import contextlib
import gc
import json
import os
import pty
import sys
import threading
from pathlib import Path

import pytest

from tactbench.core.cli import main
from tactbench.core.cli.config import shipped_results
from tactbench.core.report.datasheet import OF_DEVICES
from tactbench.core.spec.sensor import SensorSpec
from tactbench.plugin import DataSheet, PhysicalRange, Source, load_registry, sourced
from tests.conftest import Verbs

ROOT = Path(__file__).parents[3]
WISH = ("--task", "force", "--max-delay-ms", "2", "--range-n", "5", "--rate-hz", "10")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("ran"), here=True)
    asked = ("--sensor", "icub", "--task", "force", "--estimator", "ols", "--protocol", "karl2016")
    verbs("run", *asked, "--repeats", "1")
    return verbs


def on_a_terminal(*arguments):
    """Return what a terminal of 80 columns is sent: so wide is one that says that it is dumb."""
    ours, theirs = pty.openpty()
    seen = []

    def read():
        with contextlib.suppress(OSError):  # the other side has closed
            while piece := os.read(ours, 65536):
                seen.append(piece)

    reader, thresholds = threading.Thread(target=read), gc.get_threshold()
    reader.start()
    try:
        with os.fdopen(theirs, "w", buffering=1) as terminal, pytest.MonkeyPatch.context() as patch:
            patch.delenv("COLUMNS", raising=False)
            patch.setenv("TERM", "dumb")
            for stream in ("stdout", "stderr"):
                patch.setattr(sys, stream, terminal)
            with pytest.raises(SystemExit) as ended:
                main(list(arguments))
    finally:
        gc.set_threshold(*thresholds)
        reader.join()
        os.close(ours)
    assert ended.value.code == 0
    return b"".join(seen).decode().replace("\r\n", "\n")


def test_without_results_it_answers_from_those_that_came_along(verbs):
    shown = verbs("choose", *WISH).stdout
    verdict = shown.splitlines()[0]
    assert verdict.startswith(("None meets all: nearest is", "Cannot say:", "biotac SIM /", "icub SIM /"))
    assert "From the results that came with tactbench" in shown
    assert "unknown: the force range of icub: not stated" in shown
    assert "how a real unit scores" in shown
    assert verbs("choose", *WISH).stderr == ""


def test_results_of_ones_own_come_first_and_say_what_they_lack(ran):
    shown = ran("choose", *WISH).stdout
    assert "protocol karl2016 † (uses test-set statistics" in shown
    assert "there are no results under deployable" in shown
    assert "From the results in tactbench-results." in shown
    assert "how biotac scores: no result here; run `tactbench run --sensor biotac --task force" in shown
    assert ran("choose", "tactbench-results", *WISH).stdout == shown
    # A task of which the folder has nothing is answered from what came along, unless the folder was asked for.
    assert "came with tactbench" in ran("choose", "--task", "curvature").stdout
    assert "no results for the task curvature" in ran(
        "choose", "tactbench-results", "--task", "curvature", code=2
    ).stderr  # fmt: skip


def test_json_has_the_wish_the_criteria_and_what_is_unknown(verbs):
    told = json.loads(verbs("choose", *WISH, "--score", "0.2", "--format", "json").stdout)
    assert told["wish"] == {"max_delay_ms": 2, "range_n": 5, "rate_hz": 10, "score": 0.2}
    assert (told["protocol"], told["split"]) == ("deployable", "roles")
    (choice,) = told["choices"]
    assert {one["sensor"] for one in choice["candidates"]} == {"biotac", "icub"}
    for one in choice["candidates"]:
        assert [criterion["wish"] for criterion in one["criteria"]] == ["answer delay", "force range", "rate", "score"]
    assert choice["unknown"]


PAGES = (
    ("choose", *WISH, "--score", "0.2"),
    ("choose", "--task", "curvature", "--range-n", "40"),
    ("show", "force"),
    ("show", "curvature"),
    ("show", "biotac", "icub"),
    ("show", "twin", "lasso", "creep"),
)


@pytest.mark.parametrize("arguments", PAGES)
def test_eighty_columns_break_no_word(tmp_path, monkeypatch, verbs, arguments):
    monkeypatch.chdir(tmp_path)
    narrow = on_a_terminal(*arguments)
    assert max(map(len, (line.rstrip() for line in narrow.splitlines() if "See them all" not in line))) <= 80
    told = {word for word in verbs(*arguments).stdout.split() if "─" not in word}
    assert {word for word in narrow.split() if "─" not in word} == told


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "--task"),
        (("--task", "forse"), "Did you mean 'force'"),
        (("--task", "force", "--protocol", "karl"), "Did you mean 'karl2016'"),
        (("--task", "force", "--rate-hz", "-1"), "--rate-hz"),
        (("--task", "force", "--range-n", "nan"), "--range-n"),
        (("nowhere", "--task", "force"), "no results in nowhere"),
        (("--task", "shear-force"), "tactbench run --task shear-force"),
    ],
)
def test_wrong_arguments_are_answered_with_the_next_step(verbs, arguments, says):
    done = verbs("choose", *arguments, code=2)
    assert done.stdout == ""
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def test_the_shipped_results_are_of_a_run_and_travel_in_the_wheel():
    shipped = json.loads(shipped_results().read_text(encoding="utf-8"))
    assert set(shipped) == {"version", "command", "seed", "replicates", "rows"}
    asked = {(row["sensor"], row["task"], row["protocol"]) for row in shipped["rows"] if row["status"] == "done"}
    assert asked == {(sensor, task, protocol) for sensor in ("biotac", "icub") for task in ("force", "curvature")
                     for protocol in ("deployable", "karl2016")}  # fmt: skip
    assert all(row["simulated"] for row in shipped["rows"])
    assert '"examples/results" = "tactbench/results"' in (ROOT / "pyproject.toml").read_text()


def test_a_task_is_a_page(verbs):
    page = on_a_terminal("show", "force")
    assert len(page.splitlines()) < 60
    for said in ("How large is the normal force?", "RMSE N, lower is better", "0.05 N", "validation", "flat", "60 s",
                 "mean, time-index", "deployable-untared", "few-shot-10", "0.7307 N", "section III-A"):  # fmt: skip
        assert said in page
    whole = json.loads(verbs("show", "force", "--format", "json").stdout)
    assert len(whole["spec"]["scenes"]) == 3
    assert whole["spec"]["campaign_scenes"]["placement"] == 5
    assert "campaigns" not in whole["spec"], "they are thousands of lines"
    every = json.loads(verbs("show", "force", "--all", "--format", "json").stdout)
    assert len(every["spec"]["campaigns"]["placement"]) == 5
    assert "--rig replay" in verbs("show", "shear-force").stdout


def test_data_sheets_are_shown_with_their_sources_and_kept_in_json(verbs):
    shown = verbs("show", "biotac", "icub", "--all").stdout
    assert "Wettels" in shown
    lines = {line[:15].strip(): line for line in verbs("show", "biotac", "icub").stdout.splitlines()}
    assert "0.1–30 N" in lines["force range"]
    assert "unknown" in lines["force range"]
    assert lines["mass"].count("unknown") == 2
    biotac, icub = json.loads(verbs("show", "biotac", "icub", "--format", "json").stdout)
    assert biotac["data_sheet"]["force_range"]["upper"] == 30
    assert icub["data_sheet"]["length"]["value"] == 14.5
    mixed = json.loads(verbs("show", "icub", "force", "--format", "json").stdout)
    assert mixed[0]["spec"]["data_sheet"]["width"]["unit"] == "mm"


def test_every_fact_of_a_data_sheet_has_a_source_and_no_sample_depends_on_it():
    for descriptor in load_registry().sensors:
        spec: SensorSpec = descriptor.spec
        assert "data_sheet" not in spec.model_dump()
        for name in OF_DEVICES:
            fact = getattr(spec.data_sheet, name)
            assert fact is None or (fact.source.tag in ("sourced", "derived", "measured") and fact.source.reference)


def test_a_data_sheet_refuses_what_cannot_be():
    with pytest.raises(ValueError, match="measure different things"):
        DataSheet(mass=sourced(3.0, "mm", "a test"))
    source = Source(tag="sourced", reference="a test")
    with pytest.raises(ValueError, match="larger force"):
        DataSheet(force_range=PhysicalRange(lower=5.0, upper=1.0, unit="N", source=source))
