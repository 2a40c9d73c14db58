from tactbench.core.evaluation.protocols import FIRST_FRAME
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.compared import compared_section
from tactbench.core.report.results import Results
from tactbench.core.report.section import ReportData
from tactbench.core.tables.text_table import sort_value
from tests.core.leaderboard.rows import row


def subject(folder, *rows):
    return ReportData(Results(Store(folder), load_registry(), rows))


def test_a_probe_s_numbers_lead_each_to_the_cell_they_are_from(tmp_path):
    whole = row("a", score=0.5, baseline=1.0, cell="whole")
    shuffled = row("a", score=0.3, baseline=1.0, cell="shuffled", split="shuffled")
    first = row("a", score=0.9, baseline=1.0, cell="first", protocol=FIRST_FRAME.name, n_test=20)
    tables = compared_section(subject(tmp_path, whole, shuffled, first)).tables
    (table,) = [one for one in tables if one.title.startswith("Probe")]
    (line,) = table.lines
    leads = {name: entry.anchor for name, entry in zip(table.columns, line, strict=True) if name in table.numeric}
    assert leads["score"] == leads["95 % interval"] == leads["trivial"] == "cell-whole"
    assert leads["shuffled"] == "cell-shuffled"
    assert leads["first frame alone"] == "cell-first"
    values = {name: sort_value(text) for name, text in zip(table.columns, line, strict=True)}
    assert (values["score"], values["shuffled"]) == (0.5, 0.3)


def test_protocols_side_by_side_lead_each_to_their_cell(tmp_path):
    rows = [
        row(sensor, cell=f"{sensor}-{name}", protocol=name) for sensor in "ab" for name in ("karl2016", "deployable")
    ]
    rows += [row("c", cell="c-karl2016", protocol="karl2016")]  # asked in one way only: its other field is empty
    (table,) = compared_section(subject(tmp_path, *rows)).tables
    assert table.columns[2:] == ("karl2016", "deployable")
    found = [(line[0], *(entry.anchor for entry in line[2:])) for line in table.lines]
    assert sorted(found) == [
        ("a SIM", "cell-a-karl2016", "cell-a-deployable"),
        ("b SIM", "cell-b-karl2016", "cell-b-deployable"),
        ("c SIM", "cell-c-karl2016", ""),
    ]


def test_without_anything_to_compare_the_command_is_named(tmp_path):
    section = compared_section(subject(tmp_path, row()))
    assert section.tables == ()
    assert "`tactbench run --probe`" in section.missing[0]
