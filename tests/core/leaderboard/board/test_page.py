import base64
import hashlib
import html.parser
import re

import pytest

from tactbench.core.leaderboard import board
from tactbench.core.leaderboard.board import LARGEST
from tactbench.core.leaderboard.table import build_table
from tests.core.leaderboard.rendering import to_page
from tests.core.leaderboard.rows import row

from .reading import read_page, values

HOSTILE = (
    "<script>alert(1)</script>", "</script>", "<!--", "'\"><img src=x onerror=alert(1)>", "a\u202egpj", "b\x1b[31m\x00",
    "\ud800", "c\u2028d", "{the data}", "$script ${data} `rm`", "&lt;b&gt;", "ｆｕｌｌ", "x" * 5_000,
)  # fmt: skip


class Tags(html.parser.HTMLParser):
    """Counts the elements of a page."""

    def __init__(self, text):
        super().__init__()
        self.seen = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))


def some(count=6):
    rows = [row(f"s{n}", score=0.5 + n / 10, fit_s=10.0 ** (n - 3)) for n in range(count)]
    stopped = row("s9", status="failed", score=None, reason="it broke", traceback="T!")
    return [*rows, row("s0", "mean", score=1.4), stopped]


def test_what_the_page_shows_is_what_the_table_shows_digit_by_digit():
    rows = sorted([*some(), row("t", stamps=["leaks"], dagger=True)], key=lambda one: one["cell"])
    head, columns, _ = read_page(to_page(rows))
    table = build_table(rows)
    assert tuple(columns) == table.columns
    shown = [tuple(values(column)[at] for column in columns.values()) for at in head["order"]]
    assert shown == [line.cells for block in table.blocks for line in block.lines]
    assert [one["title"] for one in head["blocks"]] == [block.title for block in table.blocks]
    assert [one["size"] for one in head["blocks"]] == [len(block.lines) for block in table.blocks]


def test_a_small_page_knows_all_that_its_rows_know():
    rows = sorted(some(), key=lambda one: one["cell"])
    head, _, fields = read_page(to_page(rows))
    assert head["leftOut"] == []
    for key in rows[0]:
        expected = [one[key] for one in rows]
        if key in fields:
            assert fields[key] == expected, key
        else:
            assert all(one in (None, "", [], {}) for one in expected), key


def test_the_same_rows_in_any_order_give_the_same_page():
    rows = some()
    assert to_page(rows) == to_page(rows[::-1]) == to_page([dict(one) for one in rows])


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_is_text(name):
    tame = [row("sensor", reason="r", cell="c"), row("b", status="failed", score=None, reason="r", traceback="t")]
    plain = Tags(to_page(tame, [{"host": "h", "x": {"x": "x"}}])).seen
    stopped = row("b", status="failed", score=None, reason=name, traceback=name)
    rows = [row(name, reason=name, cell=name), stopped]
    page = to_page(rows, [{"host": name, name: {name: name}}])
    page.encode()  # no half characters
    # What stands between backticks in a note is code, which is an element of ours.
    assert [tag for tag, _ in Tags(page).seen if tag != "code"] == [tag for tag, _ in plain if tag != "code"]
    assert page.count("</script>") == 2
    assert "\u202e" not in page
    assert name in read_page(page)[2]["sensor"]


def test_the_policy_names_style_and_script_by_their_digests_and_allows_nothing_else():
    page = to_page(some())
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    digests = {
        name: base64.b64encode(hashlib.sha256(re.search(rf"<{name}>(.*?)</{name}>", page, re.S)[1].encode()).digest())
        for name in ("style", "script")
    }
    assert policy == (
        f"default-src 'none'; img-src data:; style-src 'sha256-{digests['style'].decode()}'; "
        f"script-src 'sha256-{digests['script'].decode()}'; base-uri 'none'; form-action 'none'"
    )
    for tag, attributes in Tags(page).seen:
        assert not {"style", "src", "srcset"} & set(attributes), tag
        assert not any(name.startswith("on") for name in attributes), tag
        assert attributes.get("href", "#").startswith(("#", "data:,"))


def test_a_reader_without_scripts_has_the_tables_of_a_small_board_and_a_sentence_of_a_large_one(monkeypatch):
    small = to_page([*some(), row("<b>")])
    static = small[small.index('<div id="static">') : small.index('<div id="app"')]
    assert static.count("<tr") == 1 + 9
    assert "it broke" in static
    assert "&lt;b&gt;" in static
    monkeypatch.setattr(board, "MOST_STATIC", 3)
    large = to_page(some())
    assert "needs a browser that allows it" in large
    assert large.count("<tr") == 0


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), 10**400, [[[{}]]], {"</script>": "<b>"}, "\ud800"])
def test_odd_values_under_keys_of_a_stranger_are_text(odd):
    page = to_page([row(own=odd, score=0.5, **{"</script>": odd}), row("good", score=0.6)])
    page.encode()
    _, columns, fields = read_page(page)
    assert values(columns["score"]) == ["0.5000", "0.6000"]
    assert {"own", "</script>"} <= fields.keys()
    assert page.count("</script>") == 2


def test_a_score_that_is_no_number_is_ranked_last():
    head, columns, _ = read_page(to_page([row("a", score=float("nan")), row("b")]))
    assert [values(columns["sensor"])[place] for place in head["order"]] == ["b", "a"]
    assert columns["score"]["sort"] == [None, 0.5]


def test_no_rows_at_all_are_a_page():
    assert read_page(to_page([]))[0]["rows"] == 0


def test_two_rows_of_one_cell_are_two_lines():
    _, columns, _ = read_page(to_page([row(score=0.5), row(score=0.7)]))
    assert sorted(values(columns["score"])) == ["0.5000", "0.7000"]
    assert sorted(columns["score"]["sort"]) == [0.5, 0.7]


def test_where_room_is_short_the_most_telling_stays_and_the_rest_is_named(monkeypatch):
    noise = ["".join(hashlib.sha256(f"{n}/{part}".encode()).hexdigest() for part in range(10)) for n in range(60)]
    rows = [row(f"s{n}", log=text, recordings=[text], traceback="" if n else "Traceback", key=text[:64])
            for n, text in enumerate(noise)]  # fmt: skip
    whole = to_page(rows)
    monkeypatch.setattr(board, "LARGEST", len(whole) - 1_500)
    page = to_page(rows)
    assert len(page) <= len(whole) - 1_500
    head, _, _ = read_page(page)
    assert "recordings" in head["leftOut"]
    assert {"traceback", "status", "params", "sensor"} & set(head["leftOut"]) == set()


def test_of_many_cells_every_one_has_configuration_score_cost_reason_and_traceback(monkeypatch):
    monkeypatch.setattr(board, "MANY", 5)
    rows = sorted([*some(), row("k", key="ab" * 32, wall_s=1.234567, host="h" * 12)], key=lambda one: one["cell"])
    _, _, fields = read_page(to_page(rows))
    for key in ("cell", "sensor", "task", "estimator", "protocol", "status", "reason", "seed"):
        assert fields[key] == [one[key] for one in rows]
    assert "T!" in fields["traceback"]
    assert fields["key"][[one["sensor"] for one in rows].index("k")] == "ab" * 4
    assert 1.2346 in fields["wall_s"]


def test_a_large_board_is_small():
    rows = [row(f"s{n}", f"e{m}", score=0.1 + (n * 37 % 101) / 100) for n in range(60) for m in range(50)]
    assert len(to_page(rows).encode()) < LARGEST / 4
