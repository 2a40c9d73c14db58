"""Conversion of a log that a device's own tools have written into a recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactbench.core.errors import DataError, LinkError, MissingRecordingError, UsageError
from tactbench.core.plugins.interfaces import DeviceLog
from tactbench.core.plugins.registry import load_object
from tactbench.core.recording.health import examine
from tactbench.core.recording.mapping.importing import ENDING, RIG, Imported, ImportReport
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import write_recording
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.scene import Role


def import_log(
    log: Path,
    sensor: SensorDescriptor,
    options: Mapping[str, Any],
    *,
    out: Path,
    session: str,
    role: Role | None,
    labels: Mapping[str, Scalar],
    replace: bool,
) -> ImportReport:
    """Convert a log of a sensor's own tools into a recording, which is written whole or not at all.

    Parameters
    ----------
    log
        The file, of a format that the sensor's reader knows.
    options
        For the reader, by its own names.
    out
        The recording.
    session, role, labels
        As of :class:`~tactbench.core.spec.recording.RecordingMeta`.
    replace
        Replace what `out` holds.

    Raises
    ------
    MissingRecordingError
        If there is no such log.
    UsageError
        If the sensor has no reader for logs, the file is no such log, an option is not known, or `out` is no name for a
        recording.
    RecordingError
        If `out` exists or cannot be written.
    """
    if sensor.log_reader is None:
        raise UsageError(
            f"The sensor {sensor.name!r} has no reader for logs.",
            hint="Describe the log's tables in a mapping (docs/mappings.md), or add `log_reader` to its descriptor.",
        )
    if not log.is_file():
        raise MissingRecordingError(f"There is no log {log}.", hint="Check its name.")
    if out.suffix != ENDING:
        raise UsageError(f"{out} is no name for a recording.", hint=f"Give --out a file that ends in {ENDING}.")
    try:
        found: DeviceLog = load_object(sensor.log_reader)(log, options)
    except (DataError, LinkError) as error:  # no fault of this machine: another file, or other options, are needed
        raise UsageError(error.message, hint=error.hint) from error
    began = (f"The log says that it began {found.started}.",) if found.started else ()
    meta = RecordingMeta(
        name=out.stem,
        sensor=sensor.spec.model_copy(update={"streams": found.streams}),
        rig=RIG,
        clock=found.clock,
        session=session,
        role=role,
        labels=dict(labels),
        remarks=(*found.remarks, *began),
        origin=log.name,
        counts=dict(found.counts),
    )
    write_recording(out, meta, found.blocks, {}, replace=replace)
    with open_recording(out) as written:
        rows = max(len(written.stream(name)) for name in written.stream_names)
        made = Imported(out, written.meta, rows, {}, tuple(examine(written)))
    return ImportReport(sensor.spec.title, (made,), 1, (), (), ())
