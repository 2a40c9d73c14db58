"""What a reader does with the page: opens it from disk without a network, sorts, follows numbers, reads on a phone."""

import json
import re

import pytest

pytestmark = pytest.mark.browser

SORTABLE = "return [...document.querySelectorAll('main > section > .box table.sortable')]"


def loaded(browser):
    """Return every address that the browser has asked for since the page was opened."""
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]
    return asked + [event["params"]["url"] for event in events if event["method"] == "Network.webSocketCreated"]


def column(browser, table, place):
    """Return value, where it has one, and text of each line's field."""
    script = (
        "return [...arguments[0].tBodies[0].rows].map(row => row.cells[arguments[1]])"
        ".map(cell => [cell.dataset.value ?? null, cell.textContent.trim()])"
    )
    return [tuple(pair) for pair in browser.execute_script(script, table, place)]


def test_one_file_is_all_that_is_read_and_nothing_is_said_on_the_console(opened, page):
    opened.execute_script("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    opened.execute_script("window.scrollTo(0, document.body.scrollHeight)")
    asked = [url for url in loaded(opened) if not url.startswith(("data:", "about:"))]
    assert asked == [page.as_uri()]
    assert opened.get_log("browser") == []
    assert opened.execute_script("return [...document.images].map(one => one.naturalWidth > 0)") == [True]


def test_a_script_that_is_not_ours_does_not_run_and_nothing_can_be_fetched(opened):
    opened.execute_script(
        "const one = document.createElement('script'); one.textContent = 'window.stranger = true';"
        "document.body.append(one)"
    )
    assert opened.execute_script("return window.stranger === undefined")
    fetched = opened.execute_async_script(
        "const done = arguments[0]; fetch('http://127.0.0.1:9/').then(() => done('fetched'), () => done('refused'))"
    )
    assert fetched == "refused"
    assert any("Content Security Policy" in entry["message"] for entry in opened.get_log("browser"))


SORT_BY_ALL = """
return [...arguments[0].tHead.rows[0].cells].filter(one => one.querySelector("button")).map(heading => {
  const table = arguments[0];
  const column = () => [...table.tBodies[0].rows].map(row => row.cells[heading.cellIndex])
    .map(cell => [cell.dataset.value ?? null, cell.textContent.trim()]);
  const told = {numeric: heading.classList.contains("number"), before: column(), clicks: []};
  for (const click of [1, 2]) {
    heading.querySelector("button").click();
    const sorted = [...table.querySelectorAll("th[aria-sort]")].filter(one => one.ariaSort !== "none");
    told.clicks.push([sorted.map(one => [one === heading, one.getAttribute("aria-sort")]), column()]);
  }
  return told;
})
"""


def test_every_table_sorts_by_every_column_both_ways(opened):
    tables = opened.execute_script(SORTABLE)
    assert len(tables) >= 6
    really_sorted = 0
    for table in tables:
        for told in opened.execute_script(SORT_BY_ALL, table):
            for direction, (marked, after) in zip(("ascending", "descending"), told["clicks"], strict=True):
                assert marked == [[True, direction]]  # this heading, and no other
                assert sorted(after, key=str) == sorted(told["before"], key=str)  # no line is lost or doubled
                missing = [value is None if told["numeric"] else text == "" for value, text in after]
                assert missing == sorted(missing)  # last, either way round
                if told["numeric"]:
                    values = [float(value) for value, _ in after if value is not None]
                    assert values == sorted(values, reverse=direction == "descending")
                    really_sorted += len(set(values)) > 2
    assert really_sorted >= 4


def test_times_in_different_units_are_sorted_as_times(opened):
    (table,) = [one for one in opened.execute_script(SORTABLE) if "force · RMSE" in one.accessible_name]
    (place,) = [
        i for i, one in enumerate(table.find_elements("css selector", "thead th")) if one.text.startswith("fit")
    ]
    table.find_elements("css selector", "thead th")[place].find_element("tag name", "button").click()
    told = [text for _, text in column(opened, table, place)]
    factor = {"s": 1.0, "ms": 1e-3, "µs": 1e-6}
    seconds = [float(text.split()[0]) * factor[text.split()[1]] for text in told]
    assert len({text.split()[1] for text in told}) > 1
    assert seconds == sorted(seconds)


def test_equal_lines_keep_their_order(opened):
    (table,) = [one for one in opened.execute_script(SORTABLE) if "force · RMSE" in one.accessible_name]
    headings = table.find_elements("css selector", "thead th")
    names = [one.text.split("\n")[0].strip() for one in headings]
    estimators, sensors = names.index("estimator"), names.index("sensor")
    before = column(opened, table, estimators)
    for _ in range(2):  # one sensor in all lines: nothing may move, either way
        headings[sensors].find_element("tag name", "button").click()
        assert column(opened, table, estimators) == before


@pytest.mark.parametrize("key", ["\ue007", " "], ids=["enter", "space"])
def test_a_heading_sorts_by_keyboard(opened, key):
    (table,) = [one for one in opened.execute_script(SORTABLE) if "force · RMSE" in one.accessible_name]
    heading = next(one for one in table.find_elements("css selector", "thead th") if one.text.startswith("score"))
    button = heading.find_element("tag name", "button")
    for direction in ("ascending", "descending"):
        button.send_keys(key)
        assert heading.get_attribute("aria-sort") == direction


def test_every_number_of_a_result_leads_to_its_cell_and_unfolds_it(opened):
    sections = ("reproduction", "findings", "leaderboards", "cost")
    for section in sections:
        fields = opened.execute_script(
            "return [...document.querySelectorAll(`#${arguments[0]} td.number`)]"
            ".map(one => [one.textContent.trim(), one.querySelector('a')?.hash ?? null])",
            section,
        )
        numbers = [(text, link) for text, link in fields if re.search(r"\d", text)]
        assert numbers, section
        if section == "reproduction":  # a published number that nothing has been run for has no cell
            numbers = [(text, link) for text, link in numbers if link]
        for text, link in numbers:
            assert link is not None, (section, text)
            assert link.startswith("#cell-")
        tags = opened.execute_script(
            "return arguments[0].map(link => document.querySelector(link)?.tagName)", [link for _, link in numbers]
        )
        assert set(tags) == {"DETAILS"}, section
    links = opened.find_elements("css selector", "td.number a")
    for link in links[:: max(1, len(links) // 8)]:
        target = opened.find_element("css selector", link.get_dom_attribute("href"))
        opened.execute_script("arguments[0].open = false", target)
        for _ in range(2):  # again after it was folded by hand: the address does not change then
            link.click()
            assert target.get_attribute("open") is not None
            opened.execute_script("arguments[0].open = false", target)


def test_an_address_with_a_cell_opens_it(opened, page):
    anchor = opened.execute_script("return document.querySelector('details.cell').id")
    opened.get("about:blank")
    opened.get(f"{page.as_uri()}#{anchor}")
    assert opened.find_element("id", anchor).get_attribute("open") is not None


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1400])
def test_the_page_never_scrolls_sideways(opened, width, scheme):
    metrics = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    opened.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    )
    opened.execute_script("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    assert opened.execute_script("return window.innerWidth") == width
    assert opened.execute_script("return document.documentElement.scrollWidth") <= width
    paper = opened.execute_script("return getComputedStyle(document.body).backgroundColor")
    lightness = sum(int(one) for one in re.findall(r"\d+", paper)[:3]) / 3
    assert (lightness > 128) == (scheme == "light")


def test_a_keyboard_reader_can_skip_the_contents(opened):
    opened.find_element("tag name", "body").send_keys("\ue004")
    first = opened.switch_to.active_element
    assert first.text == "Skip to the results"
    assert opened.execute_script("return arguments[0].getBoundingClientRect().left >= 0", first)
    first.send_keys("\ue007")
    assert opened.execute_script("return location.hash") == "#main"


@pytest.mark.parametrize(("width", "where"), [(390, "main"), (1280, "#reproduction")])
def test_sentences_in_tables_are_read_without_scrolling_them(opened, width, where):
    metrics = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    boxes = opened.execute_script(
        "return [...document.querySelectorAll(`${arguments[0]} .box`)].filter(one => one.querySelector('.wordy'))"
        ".map(one => [one.scrollWidth, one.clientWidth])",
        where,
    )
    assert boxes
    assert [pair for pair in boxes if pair[0] > pair[1]] == []


def test_several_notes_are_folded_until_they_are_asked_for_or_printed(opened):
    folded = opened.find_elements("css selector", "details.folded")
    assert folded
    assert not any(one.get_attribute("open") for one in folded)
    assert not folded[0].find_element("css selector", "li").is_displayed()
    opened.execute_script("window.dispatchEvent(new Event('beforeprint'))")
    assert all(one.get_attribute("open") for one in folded)


def test_what_came_out_is_the_first_thing_and_its_links_lead_to_their_tables(opened):
    links = opened.find_elements("css selector", "main > section:first-child .answers a")
    assert [one.get_dom_attribute("href") for one in links] == ["#reproduction", "#leaderboard-1", "#leaderboard-2"]
    for link in links:
        target = opened.find_element("css selector", link.get_dom_attribute("href"))
        link.click()
        top = opened.execute_script("return arguments[0].getBoundingClientRect().top", target)
        assert -1 <= top <= opened.execute_script("return window.innerHeight")
