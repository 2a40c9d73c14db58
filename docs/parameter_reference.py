"""The page ``parameters.md``: every number of the simulated sensors and who says so, as `tactbench show` prints them.

``conf.py`` writes the page when the site is built.
"""

from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.datasheet import quantities, sensor_table
from tactbench.core.tables.markup import markdown

_TITLE = """# Parameters of the simulated sensors

Every number the twin uses, and who says so. Tags: *sourced* (stated in a document), *measured* (on recordings),
*derived* (computed from those), *assumed* (nobody says so). A name with its unit is a nuisance, which
`tactbench run --set NAME=X` sets ([twin.md](twin.md#nuisances-by-name)). Rows of a scenario hold where
`--set scenario=NAME` asks for it.

"""


def reference() -> str:
    """Return the whole document."""
    sensors = load_registry().sensors
    specs = [sensors[name].spec for name in ("biotac", "icub", "ideal")]
    tables = markdown([sensor_table(one.title, [one], quantities, with_source=True) for one in specs])
    return _TITLE + tables.replace("### ", "## ")
