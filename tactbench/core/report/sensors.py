"""The sensors side by side: the paper's Table I, and who states each fact."""

from __future__ import annotations

from tactbench.core.errors import TactbenchError
from tactbench.core.leaderboard.levels import KEY as LEVEL
from tactbench.core.recording.reader import read_meta
from tactbench.core.report.datasheet import details, sensor_table, table_one
from tactbench.core.report.section import ReportData, Section
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.tables.text import command_line

_READINGS = 5
"""So many first lines of `details` are about readings; the parameters behind them are for `tactbench show --all`."""


def sensors_section(subject: ReportData) -> Section:
    """Return the comparison of the sensors that the results are about."""
    title = "Sensors (the paper's Table I)"
    names = dict.fromkeys(str(row["sensor"]) for row in subject.rows)
    found = {name: _spec(name, subject) for name in names}
    specs = [spec for spec in found.values() if spec is not None]
    unknown = tuple(
        f"{name}: neither installed nor in a recording of these results; see `tactbench list plugins`."
        for name, spec in found.items()
        if spec is None
    )
    if not specs:
        return Section("sensors", title, notes=_levels(subject), missing=unknown or ("No cell names a sensor.",))
    return Section(
        "sensors",
        title,
        paragraphs=(
            "Every parameter of these sensors, and who states it: "
            f"`{command_line('tactbench', 'show', *found, '--all')}`.",
        ),
        tables=tuple(
            sensor_table(name, specs, properties, with_source=True).compact()
            for name, properties in (("Sensor comparison", table_one(specs)), ("Readings", details(specs)[:_READINGS]))
        ),
        notes=(*_levels(subject), *unknown),
    )


def _levels(subject: ReportData) -> tuple[str, ...]:
    """Return what `tactbench check` has found of each sensor, in a sentence; nothing where none was checked."""
    found = {str(row["sensor"]): str(row[LEVEL]) for row in subject.rows if LEVEL in row}
    listed = ", ".join(f"{name} {level}" for name, level in found.items())
    return (f"Levels that `tactbench check` has computed: {listed}.",) if found else ()


def _spec(name: str, subject: ReportData) -> SensorSpec | None:
    """Return a sensor's spec: the installed one, else the one that a recording carries."""
    registry = subject.results.registry
    try:
        if name in registry.sensors:
            return registry.sensors[name].spec
        for row in subject.rows:
            if row["sensor"] == name:
                for path in subject.results.recordings(row):
                    return read_meta(path).sensor
    except TactbenchError:
        pass  # given twice, or a damaged file: the section says that it is not known
    return None
