"""A real page of a real small run, opened in a headless Chromium that speaks to nobody."""

import os
import shutil
from pathlib import Path

import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.progress import Progress
from tactbench.core.report.page import make_report
from tactbench.core.report.results import open_results
from tests.core.report.results import make_results


def _found(variable, *names):
    """Return the program that `variable` names, or the first of `names` on the path."""
    given = os.environ.get(variable)
    return given or next((found for name in names if (found := shutil.which(name))), None)


@pytest.fixture(scope="session")
def chromium():
    """A headless Chromium that logs what it loads and says; skipped where there is none."""
    browser = _found("TACTBENCH_CHROMIUM", "chromium", "chromium-browser", "google-chrome")
    driver = _found("TACTBENCH_CHROMEDRIVER", "chromedriver")
    if browser is None or driver is None:
        pytest.skip(
            "no chromium and chromedriver on the path (Debian: apt-get install chromium chromium-driver); "
            "TACTBENCH_CHROMIUM and TACTBENCH_CHROMEDRIVER name others"
        )
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed: pip install '.[test]'")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    # No sandbox: continuous integration is root in a container, and the page is our own. /dev/shm is small there.
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    running = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield running
    running.quit()


@pytest.fixture(scope="session")
def page(tmp_path_factory) -> Path:
    """The page of a small run, with a figure and skipped cells."""
    folder = make_results(tmp_path_factory.mktemp("page") / "results", "icub")
    material = open_results(Store(folder), load_registry())
    row = next(row for row in material.rows if row["status"] == "done" and row["task"] == "force")
    row["fit_s"] = 2.5  # as on a slow machine: its neighbours' times are in milliseconds
    make_report(material, folder / "report", Progress())
    return folder / "report" / "index.html"


@pytest.fixture
def opened(chromium, page):
    """The page, freshly opened from disk, wide and light."""
    chromium.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    for log in ("browser", "performance"):
        chromium.get_log(log)  # what an earlier page said is not this one's
    chromium.get("about:blank")
    chromium.get(page.as_uri())
    return chromium
