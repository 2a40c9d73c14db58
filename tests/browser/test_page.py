"""What a reader does with the page: opens it from disk without a network, sorts, filters, unfolds, reads on a phone."""

import json

import pytest

pytestmark = pytest.mark.browser

COLUMN = (
    "return [...arguments[0].tBodies[0].rows].map(row => row.cells[arguments[1]])"
    ".map(cell => [cell.dataset.value ?? null, cell.textContent.trim()])"
)


def loaded(browser):
    """Return every address that the browser has asked for since the page was opened."""
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]


def resize(browser, width):
    metrics = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def board(browser, task):
    """Return the table of a task, and its headings by what they say."""
    (block,) = [one for one in browser.find_elements("css selector", "#leaderboards .block")
                if one.find_element("css selector", ".caption").text.lower().startswith(task)]  # fmt: skip
    headings = block.find_elements("css selector", "thead th")
    return block.find_element("tag name", "table"), {one.text.rstrip(" ↕↑↓"): one for one in headings}


def test_one_file_is_all_that_is_read(opened, page):
    opened.execute_script("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    assert [url for url in loaded(opened) if not url.startswith(("data:", "about:"))] == [page.as_uri()]
    assert opened.get_log("browser") == []
    widths = opened.execute_script("return [...document.images].map(one => one.naturalWidth)")
    assert min(widths) > 0


def test_sort_filter_and_details(opened):
    table, headings = board(opened, "force")
    names = list(headings)
    # By value, times in different units too, by mouse and by key; what has none comes last either way.
    time = next(name for name in names if name in ("fit", "training"))
    for click, direction in ((True, "ascending"), (False, "descending")):
        button = headings[time].find_element("tag name", "button")
        button.click() if click else button.send_keys("\ue007")
        assert headings[time].get_attribute("aria-sort") == direction
        told = opened.execute_script(COLUMN, table, names.index(time))
        values = [float(value) for value, _ in told if value is not None]
        assert len({text.split()[1] for _, text in told if text}) > 1
        assert values == sorted(values, reverse=direction == "descending")
        assert [value is None for value, _ in told] == sorted(value is None for value, _ in told)
    filter_ = opened.find_element("id", "filter")
    lines = "return [...document.querySelectorAll('#leaderboards tbody tr')].filter(one => one.offsetParent !== null)"
    every = len(opened.execute_script(lines))
    filter_.send_keys("FOREST force")
    assert ["forest" in line.text for line in opened.execute_script(lines)] == [True]
    assert opened.find_element("id", "found").text.split()[:3] == ["1", "of", str(every)]
    filter_.clear()
    filter_.send_keys(" ")
    assert len(opened.execute_script(lines)) == every

    for link in opened.find_elements("css selector", "#leaderboards tbody a"):
        target = opened.find_element("css selector", link.get_dom_attribute("href"))
        assert not target.is_displayed()
        link.click()
        assert target.is_displayed()
        target.find_element("xpath", "../summary").click()


@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_never_scrolls_sideways_and_sentences_in_tables_are_read_without(opened, width):
    resize(opened, width)
    opened.execute_script("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    assert opened.execute_script("return document.documentElement.scrollWidth") <= width
    boxes = opened.execute_script(
        "return [...document.querySelectorAll('#leaderboards .box, #reproduction .box')]"
        ".filter(one => one.querySelector('.wordy')).map(one => one.scrollWidth - one.clientWidth)"
    )
    assert boxes
    assert max(boxes) <= 0
    buttons = opened.find_elements("css selector", "#leaderboards th button")
    assert all(one.is_displayed() for one in buttons)
