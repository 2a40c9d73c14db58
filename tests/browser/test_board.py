"""What a reader does with a board: opens it from disk, sorts, filters, compares, follows numbers; with keys alone."""

import base64
import json
import math
import re

import pytest

from tactbench.core.leaderboard.columns import OF_ROWS
from tactbench.core.leaderboard.table import build_table
from tactbench.core.tables.text import visible
from tests.browser.boards import HOST, HOSTILE, PROVENANCE, board_rows
from tests.browser.test_page import loaded
from tests.core.leaderboard.rendering import to_page
from tests.core.leaderboard.rows import row

pytestmark = pytest.mark.browser

ENTER, ESCAPE, RIGHT, TAB, END = "\ue007", "\ue00c", "\ue014", "\ue004", "\ue010"
READY = "return document.documentElement.dataset.ready === 'yes' || !document.getElementById('trouble').hidden"
LINES = """return [...document.querySelectorAll('#lines tbody')].map(body => [...body.rows].map(line =>
  [line.className, [...line.cells].map(cell => cell.textContent)]))"""


@pytest.fixture(scope="module")
def rows():
    return sorted(board_rows(), key=lambda one: one["cell"])


@pytest.fixture(scope="module")
def path(tmp_path_factory, rows):
    """The board, as a file."""
    file = tmp_path_factory.mktemp("board") / "board.html"
    file.write_text(to_page(rows, PROVENANCE), encoding="utf-8")
    return file


def show(browser, path, fragment=""):
    """Open a page freshly, wide and light, and wait until it is drawn."""
    from selenium.webdriver.support.wait import WebDriverWait

    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
    for log in ("browser", "performance"):
        browser.get_log(log)
    browser.get("about:blank")
    browser.get(path.as_uri() + fragment)
    WebDriverWait(browser, 20).until(lambda one: one.execute_script(READY))
    return browser


@pytest.fixture
def board(chromium, path):
    return show(chromium, path)


def choose(browser, picker, text):
    """Choose the option of a picker that begins with a text."""
    browser.execute_async_script(
        "const [id, text, done] = arguments; const one = document.getElementById(id);"
        "one.value = [...one.options].find(option => option.text.startsWith(text)).value;"
        "one.dispatchEvent(new Event('input', {bubbles: true})); requestAnimationFrame(() => setTimeout(done))",
        picker,
        text,
    )


def lines(browser):
    """Return class and texts of each line, the headings of blocks aside."""
    return [line for body in browser.execute_script(LINES) for line in body if line[0] != "block"]


def hashes(browser, links):
    script = "return [...document.querySelectorAll(arguments[0])].map(one => one.hash)"
    return browser.execute_script(script, links)


def opened_cells(browser, links):
    """Open the cells of different addresses one after another; return the title of each."""
    return browser.execute_async_script(
        "const [links, done] = arguments; (async () => { const titles = []; for (const link of links) {"
        " await new Promise(go => { addEventListener('hashchange', go, {once: true}); location.hash = link; });"
        " titles.push(document.getElementById('cell-title').textContent); } done(titles); })()",
        links,
    )


def found(browser):
    return browser.find_element("id", "found").text


def test_one_file_is_all_that_is_read_and_nothing_is_said_on_the_console(board, path):
    for view in ("matrix", "time", "tables"):
        board.find_element("id", f"tab-{view}").click()
    board.execute_script("location.hash = document.querySelector('#lines td.number a').hash")
    asked = [url for url in loaded(board) if not url.startswith(("data:", "about:"))]
    assert asked == [path.as_uri()]
    assert board.get_log("browser") == []
    assert board.execute_script("return document.getElementById('trouble').hidden")


def test_a_script_that_is_not_ours_does_not_run_and_nothing_can_be_fetched(board):
    board.execute_script(
        "const one = document.createElement('script'); one.textContent = 'window.stranger = true';"
        "document.body.append(one)"
    )
    assert board.execute_script("return window.stranger === undefined")
    fetched = board.execute_async_script(
        "const done = arguments[0]; fetch('http://127.0.0.1:9/').then(() => done('fetched'), () => done('refused'))"
    )
    assert fetched == "refused"
    assert any("Content Security Policy" in entry["message"] for entry in board.get_log("browser"))


def test_names_are_text_wherever_they_stand(board):
    texts = {text for _, line in lines(board) for text in line}
    for name in HOSTILE:
        assert f"{visible(name)} SIM" in texts
    for view in ("matrix", "time"):
        board.find_element("id", f"tab-{view}").click()
        assert board.execute_script("return document.querySelectorAll('main img, main script, main b').length") == 0
    board.find_element("id", "tab-tables").click()
    links = sorted(set(hashes(board, "#lines tr.result a")))
    assert len(set(opened_cells(board, links))) == len(links)
    assert board.execute_script("return window.stranger === undefined")
    assert board.execute_script("return document.querySelectorAll('dialog script, dialog img, dialog i').length") == 0
    assert "\u202e" not in board.execute_script("return document.body.textContent")


def test_the_lines_are_those_of_the_table_digit_by_digit(board, rows):
    table = build_table(rows)
    shown = board.execute_script(LINES)
    assert [body[0][1][0] for body in shown] == ["".join([block.title, *block.verdict]) for block in table.blocks]
    empty = {place for place, name in enumerate(table.columns)
             if all(line.cells[place] in ("", "–") for block in table.blocks for line in block.lines)}  # fmt: skip
    for body, block in zip(shown, table.blocks, strict=True):
        for (kind, texts), line in zip(body[1:], block.lines, strict=True):
            assert kind == line.kind
            expected = [text for place, text in enumerate(line.cells) if place not in empty]
            if kind in ("result", "baseline"):
                assert texts == expected
            else:  # the reason in place of numbers
                assert texts[:-1] == expected[: len(texts) - 1]
                assert texts[-1] in ("signal 11", "needs a vibration stream")


@pytest.mark.parametrize("name", ["score", "95 % interval", "fit", "latency p50", "sessions", "batch/row"])
def test_a_column_sorts_by_value_inside_each_block_and_dashes_come_last(board, rows, name):
    by_name = {}
    for one, value in zip(rows, map(OF_ROWS[name].value, rows), strict=True):
        by_name.setdefault((one["task"], f"{visible(one['sensor'])} SIM"), []).append(value)
    heading = next(one for one in board.find_elements("css selector", "#lines th") if one.text.startswith(name))
    place = board.execute_script("return arguments[0].cellIndex", heading)
    for direction in ("ascending", "descending"):
        headings = board.find_elements("css selector", "#lines thead th")
        headings[place].find_element("tag name", "button").click()
        assert board.execute_script(
            "return [...document.querySelectorAll('#lines th')].filter(one => one.ariaSort !== 'none' && one.ariaSort)"
            ".map(one => [one.cellIndex, one.ariaSort])"
        ) == [[place, direction]]
        large = [body for body in board.execute_script(LINES) if len(body) > 20]
        assert len(large) == 2
        for body in large:
            task = body[0][1][0].split(" · ")[0]
            values = []
            for _, texts in body[1:]:
                of_name = by_name[task, texts[1]]
                values.append(of_name[0] if len(of_name) == 1 else None)
            there = [value for value in values if value is not None]
            assert len(there) >= 20
            assert there == sorted(there, reverse=direction == "descending")
            dashes = [len(texts) <= place or texts[place] in ("", "–") for _, texts in body[1:]]
            assert dashes == sorted(dashes)


def test_a_heading_sorts_by_keyboard_and_keeps_the_focus(board):
    button = next(one for one in board.find_elements("css selector", "#lines th button") if one.text == "fit")
    button.send_keys(ENTER)
    assert board.switch_to.active_element.text == "fit"
    board.switch_to.active_element.send_keys(" ")
    assert board.switch_to.active_element.find_element("xpath", "..").get_attribute("aria-sort") == "descending"


def test_filters_leave_what_was_asked_for(board, rows):
    assert found(board) == f"{len(rows)} cells"
    choose(board, "pick-status", "crashed")
    assert found(board) == f"1 of {len(rows)} cells"
    assert [line[1][-1] for line in lines(board)] == ["signal 11"]
    board.find_element("css selector", "button[type=reset]").click()
    choose(board, "pick-hardware", "hardware")
    assert [line[1][1] for line in lines(board)] == ["real"]
    choose(board, "pick-hardware", "all")
    choose(board, "pick-task", "kind")
    assert {body[0][1][0].split(" · ")[0] for body in board.execute_script(LINES)} == {"kind"}
    choose(board, "pick-sensor", "s03")
    assert [line[1][1] for line in lines(board)] == ["s03 SIM"]


@pytest.mark.parametrize(
    ("typed", "count"), [("vibration", 1), ("S07 KIND", 1), ("s0 crashed", 1), ("img onerror", 1), ("nothing so", 0)]
)
def test_every_word_that_is_typed_must_be_found(board, rows, typed, count):
    board.find_element("id", "find").send_keys(typed)
    board.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 50))")
    assert found(board) == f"{count} of {len(rows)} cells"
    assert len(lines(board)) == count


def test_every_number_leads_to_its_cell(board, rows):
    fields = board.execute_script(
        "return [...document.querySelectorAll('#lines td.number')]"
        ".map(one => [one.textContent, one.querySelector('a')?.hash])"
    )
    numbers = [(text, link) for text, link in fields if re.search(r"\d", text)]
    assert len(numbers) > 5 * len(rows)
    assert all(link and link.startswith("#cell=") for _, link in numbers)
    assert len({link for _, link in numbers if link}) == len(rows) - 2  # two have no number
    names = {visible(one["cell"]) for one in rows}
    for title in opened_cells(board, sorted({link for _, link in numbers})):
        names.remove(title)


def test_a_cell_tells_all_that_is_known_of_it(board):
    board.find_element("id", "find").send_keys("signal 11")
    board.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 50))")
    link = board.find_element("css selector", "#lines tbody a")
    link.send_keys(ENTER)
    dialog = board.find_element("id", "cell")
    assert dialog.is_displayed()
    told = board.execute_script("return document.getElementById('cell').textContent")
    for text in ("crashed: signal 11", "Traceback (most recent call last):\n  File <b>x</b>", "\\x1b[1mthis\nand that",
                 "tactbench why s01/crashed", "tactbench rerun s01/crashed"):  # fmt: skip
        assert text in told
    board.switch_to.active_element.send_keys(ESCAPE)
    assert not dialog.is_displayed()
    assert "#cell=" not in board.current_url
    assert board.execute_script("return document.activeElement.hash?.startsWith('#cell=')")


@pytest.mark.parametrize(
    ("cell", "texts"),
    [
        ("s03/kind", ["fold 2", "0.625", "as soft", "Confusion"]),
        ("real/", ["creep", "nobody hears it", "drift", "0.1 %"]),
        ("s00/question", ["3.11.7", "<u>cpu</u>", "numpy", f"cells/{0:064x}.h5", "concurrency", "n_sessions"]),
    ],
)
def test_an_address_with_a_cell_opens_it(board, path, cell, texts):
    links = hashes(board, "#lines td.number a")
    plain = cell.replace("/", "-")
    link = next(one for one in links if one.startswith(f"#cell={plain}") and "-mean-" not in one)
    show(board, path, link)
    assert board.execute_script("return document.getElementById('cell').open")
    told = board.execute_script("return document.getElementById('cell').textContent")
    for text in texts:
        assert text in told
    assert board.get_log("browser") == []


def test_a_name_for_no_shell_has_no_command_and_others_are_quoted(chromium, tmp_path):
    file = tmp_path / "names.html"
    file.write_text(to_page([row("a'b; rm -rf ~", cell="a'b; rm -rf ~"), row("c\nd", cell="c\nd")]), encoding="utf-8")
    show(chromium, file)
    told = []
    for link in hashes(chromium, "#lines a[href]:not([tabindex])"):
        chromium.execute_script("location.hash = arguments[0]", link)
        chromium.execute_async_script("setTimeout(arguments[0])")
        told.append(chromium.execute_script("return document.getElementById('cell').textContent"))
    assert any("tactbench why 'a'\"'\"'b; rm -rf ~'" in text for text in told)
    assert any("what no command line should be given" in text and "tactbench why" not in text for text in told)


def test_a_cell_that_is_not_there_is_said_so(chromium, path):
    show(chromium, path, "#cell=nobody-00000000")
    assert chromium.find_element("id", "trouble").text == "This board has no cell nobody-00000000."


def matrix(browser, place):
    return browser.execute_script(
        "return [...document.querySelectorAll('#matrix tbody tr')].map(line => line.cells[arguments[0]].textContent)",
        place,
    )


def texts_of(browser, selector):
    script = "return [...document.querySelectorAll(arguments[0])].map(one => one.textContent)"
    return browser.execute_script(script, selector)


def test_the_matrix_has_every_cell_and_sorts_the_best_first(board, rows):
    board.find_element("id", "tab-matrix").click()
    assert len(texts_of(board, "#matrix tbody td:not(.none)")) == len({
        (one["task"], one["sensor"], one["estimator"]) for one in rows if one["cell"] != "s01/crashed"
    })  # fmt: skip
    titles = texts_of(board, "#matrix thead button")
    for task, reverse in (("question", False), ("kind", True)):
        place = titles.index(task)
        board.find_elements("css selector", "#matrix thead button")[place].click()
        shown = [float(text) for text in matrix(board, place) if re.fullmatch(r"[\d.]+", text)]
        assert len(shown) >= 24
        assert shown == sorted(shown, reverse=reverse)
    best = max(one["score"] for one in rows if one["task"] == "kind")
    assert f"{best:.3f}" in texts_of(board, "#matrix td.best")
    head = board.find_element("css selector", "#matrix thead th")
    assert head.value_of_css_property("position") == "sticky"


def front(rows, task, time, host, lower):
    """Return the sensors of the cells that no other cell of this host beats in both, by comparing all pairs."""
    some = [one for one in rows if one["task"] == task and one["status"] == "done" and one["host"] == host
            and one["simulated"] and not one["is_baseline"]]  # fmt: skip
    sign = 1 if lower else -1

    def beats(one, other):
        pair = [(one[time], other[time]), (sign * one["score"], sign * other["score"])]
        return all(a <= b for a, b in pair) and any(a < b for a, b in pair)

    return {one["sensor"] for one in some if not any(beats(other, one) for other in some)}


@pytest.mark.parametrize(("task", "lower"), [("question", True), ("kind", False)])
@pytest.mark.parametrize(("axis", "time"), [("latency p50", "latency_ms_p50"), ("fit", "fit_s")])
def test_the_front_is_what_nothing_of_its_host_beats_in_both(board, rows, task, lower, axis, time):
    board.find_element("id", "tab-time").click()
    choose(board, "time-block", f"{task} · " if task == "kind" else "question · RMSE [N], lower is better · deployable")
    choose(board, "time-axis", axis)
    marked = board.execute_script(
        "return [...document.querySelectorAll('svg .on-front')]"
        ".map(one => one.getAttribute('aria-label').split(' SIM')[0])"
    )
    some = [one for one in rows if one["task"] == task and one["host"] == HOST and one["simulated"] and one["score"]]

    def told(sensors):  # of equals in both, one stands on the front
        return {(one[time], one["score"]) for one in some if one["sensor"] in sensors and not one["is_baseline"]}

    assert len(marked) >= 2
    assert told(marked) == told(front(rows, task, time, HOST, lower))
    assert "are not drawn: times of two hosts" in board.find_element("tag name", "figcaption").text
    drawn = len(board.find_elements("css selector", "svg .point"))
    assert drawn == len(some)


def test_points_stand_where_their_numbers_are(board, rows):
    board.find_element("id", "tab-time").click()
    choose(board, "time-block", "kind · ")
    at = board.execute_script(
        "return [...document.querySelectorAll('svg circle.point')].map(one => "
        "[one.getAttribute('aria-label').split(' ')[0], +one.getAttribute('cx'), +one.getAttribute('cy')])"
    )
    of_sensor = {one["sensor"]: one for one in rows if one["task"] == "kind"}
    across = sorted((math.log(of_sensor[name]["latency_ms_p50"]), x) for name, x, _ in at)
    down = sorted((-of_sensor[name]["score"], y) for name, _, y in at)
    for pairs in (across, down):
        (first, low), (last, high) = pairs[0], pairs[-1]
        for value, place in pairs:  # a pixel: values are told to the 254th of a digit
            assert place == pytest.approx(low + (value - first) / (last - first) * (high - low), abs=1)


def test_the_figure_is_walked_with_arrow_keys_and_opens_cells(board):
    board.find_element("id", "tab-time").click()
    assert len(board.find_elements("css selector", "svg [tabindex='0']")) == 1
    board.find_element("css selector", "svg [tabindex='0']").send_keys(RIGHT)
    told = board.switch_to.active_element.get_attribute("aria-label")
    assert board.find_element("css selector", ".tip").text.split("\n") == told.split(", ")
    rests = "document.querySelector('#view-time svg').dispatchEvent(new PointerEvent('pointerover', {bubbles: true}))"
    board.execute_script(rests)  # a pointer beside the points, as after a click on the tab
    assert board.find_element("css selector", ".tip").text.split("\n") == told.split(", ")
    board.switch_to.active_element.send_keys(END)
    board.switch_to.active_element.send_keys(ENTER)
    board.execute_async_script("setTimeout(arguments[0])")
    assert board.execute_script("return document.getElementById('cell').open")


def test_tabs_are_walked_with_arrow_keys(board):
    board.find_element("id", "tab-tables").send_keys(RIGHT)
    assert board.switch_to.active_element.get_attribute("id") == "tab-matrix"
    assert board.find_element("id", "view-matrix").is_displayed()
    assert board.current_url.endswith("#view=matrix")


def test_a_keyboard_reader_can_skip_to_the_results(board):
    board.find_element("tag name", "body").send_keys(TAB)
    first = board.switch_to.active_element
    assert first.text == "Skip to the results"
    first.send_keys(ENTER)
    assert board.execute_script("return document.activeElement.id") == "main"


def test_a_large_board_is_turned_over_page_by_page(chromium, tmp_path):
    rows = [row(f"s{n:03d}", score=0.1 + n / 1000) for n in range(650)]
    file = tmp_path / "large.html"
    file.write_text(to_page(rows), encoding="utf-8")
    show(chromium, file)
    seen = [line[1][1] for line in lines(chromium)]
    assert len(seen) == 200
    for _ in range(3):
        chromium.find_element("css selector", "#lines-pager [data-go=next]").send_keys(ENTER)
        seen += [line[1][1] for line in lines(chromium)]
    assert seen == [f"s{n:03d} SIM" for n in range(650)]
    assert chromium.switch_to.active_element.tag_name == "button"
    assert chromium.find_element("css selector", "#lines-pager span").text == "lines 601 to 650 of 650"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1400])
def test_the_page_never_scrolls_sideways(board, width, scheme):
    metrics = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    board.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    board.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    for view in ("tables", "matrix", "time"):
        board.execute_script("document.getElementById(`tab-${arguments[0]}`).click()", view)
        assert board.execute_script("return document.documentElement.scrollWidth") <= width
    board.execute_script("location.hash = document.querySelector('#lines td.number a').hash")
    board.execute_async_script("setTimeout(arguments[0])")
    dialog = board.find_element("id", "cell")
    assert board.execute_script("return arguments[0].scrollWidth <= arguments[0].clientWidth", dialog)
    paper = board.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (sum(int(one) for one in re.findall(r"\d+", paper)[:3]) / 3 > 128) == (scheme == "light")


def test_a_printed_board_is_its_tables_without_controls(board):
    board.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    for hidden in ("filters", "views"):
        assert not board.find_element("id", hidden).is_displayed()
    assert board.find_element("id", "lines").is_displayed()
    pdf = base64.b64decode(board.execute_cdp_cmd("Page.printToPDF", {})["data"])
    assert pdf.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) >= 1


def test_without_scripts_the_tables_are_there(chromium, path, rows):
    chromium.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        chromium.get("about:blank")
        chromium.get(path.as_uri())
        told = chromium.find_element("tag name", "main").text
    finally:
        chromium.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert f"{max(one['score'] for one in rows if one['task'] == 'kind'):.3f}" in told
    assert "crashed: signal 11" in told
    for name in HOSTILE[:4]:
        assert name in told


def test_a_browser_that_cannot_unpack_says_so_and_shows_the_plain_tables(chromium, path):
    script = {"source": "delete window.DecompressionStream"}
    added = chromium.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", script)
    try:
        show(chromium, path)
        assert "DecompressionStream" in chromium.find_element("id", "trouble").text
        assert chromium.find_element("id", "static").is_displayed()
    finally:
        chromium.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def test_data_that_was_cut_short_is_said_so(chromium, path, tmp_path):
    page = path.read_text(encoding="utf-8")
    start = page.index('id="data">') + len('id="data">')
    data = json.loads(page[start : page.index("</script>", start)])
    data[0] = data[0][:40]
    damaged = tmp_path / "damaged.html"
    damaged.write_text(page[:start] + json.dumps(data) + page[page.index("</script>", start) :], encoding="utf-8")
    show(chromium, damaged)
    assert "cannot be shown" in chromium.find_element("id", "trouble").text
    assert chromium.find_element("id", "static").is_displayed()
    chromium.get_log("browser")
