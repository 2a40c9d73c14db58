"""Times of different hosts are never mistaken for comparable; scores do not depend on the host."""

from tactbench.core.leaderboard.columns import host_letters
from tactbench.core.leaderboard.table import build_table

from .rows import row

KNOWN = [{"host": "h1", "cpu": "Fast 9", "cores": 8}, {"host": "h2", "cpu": "Slow 1", "cores": 2}]


def cells(table, name):
    return [line.cells[table.columns.index(name)] for block in table.blocks for line in block.lines]


def test_one_host_alone_needs_no_letters():
    table = build_table([row(host="h1", concurrency=1), row("b", host="h1", concurrency=1)], KNOWN)
    assert cells(table, "fit") == ["500 ms", "500 ms"]
    assert not [note for note in table.notes if "timed" in note]


def test_hosts_share_a_ranking_and_every_time_says_whose_it_is():
    table = build_table([row("b", score=0.7, host="h1"), row(score=0.5, host="h2")], KNOWN)
    assert cells(table, "#") == ["1", "2"]
    for name in ("fit", "latency p50", "p95", "batch/row"):
        assert [text[-4:] for text in cells(table, name)] == [" [B]", " [A]"]
    assert cells(table, "score") == ["0.5000", "0.7000"]
    assert "[A] timed on host h1: Fast 9, 8 cores." in table.notes
    assert "[B] timed on host h2: Slow 1, 2 cores." in table.notes
    assert any("compare none of them" in note for note in table.notes)


def test_letters_depend_on_the_hosts_alone_and_go_on_after_z():
    rows = [row(host=f"h{n:02d}") for n in range(28)]
    letters = host_letters(rows)
    assert letters == host_letters(rows[::-1])
    assert (letters["h00"], letters["h25"], letters["h26"], letters["h27"]) == ("A", "Z", "AA", "AB")


def test_a_host_without_a_name_or_provenance_is_told_apart_too():
    table = build_table([row(host=""), row("b", host="h3")], KNOWN)
    assert "[A] timed on a host that its rows do not name, of which nothing else is known." in table.notes
    assert "[B] timed on host h3, of which nothing else is known." in table.notes


def test_a_cell_that_failed_elsewhere_has_no_times_to_mark():
    rows = [row(host="h1"), row("b", host="h2", status="failed", score=None, reason="no")]
    assert host_letters(rows) == {}


def test_cells_timed_beside_others_say_so():
    rows = [row(host="h2", concurrency=1), row("b", host="h2", concurrency=2), row("c", host="h2", concurrency=4)]
    table = build_table(rows, KNOWN)
    assert cells(table, "fit") == ["500 ms", "500 ms ‖2", "500 ms ‖4"]
    assert "‖2: timed while 2 cells ran at once: not comparable with times measured alone." in table.notes
    crowded = (
        "‖4: timed while 4 cells ran at once, more than the cores of host h2: not comparable with times measured alone."
    )
    assert crowded in table.notes


def test_without_times_there_are_no_hosts():
    rows = [row(host="h1", concurrency=4), row("b", host="h2")]
    table = build_table(rows, KNOWN, times=False)
    assert not {"sim", "fit", "latency p50", "p95", "batch/row"} & set(table.columns)
    assert not [note for note in (*table.notes, *table.footer) if "h1" in note or "timed" in note]
