"""``tactbench datasets``: the list of public data sets that ``run --dataset`` accepts."""

from __future__ import annotations

import click

from tactbench.core.cli.shared import GRID_FORMATS, format_option, print_records
from tactbench.core.errors import ConfigError
from tactbench.core.recording.datasets import cache, datasets
from tactbench.core.tables.terminal import remark


@click.command(name="datasets")
@format_option(*GRID_FORMATS)
def command(shape: str) -> None:
    """List public data sets: quantity measured, size, licence, citation, and whether the data are on this machine.

    `tactbench run --dataset NAME` fetches missing files, once. A data set that cannot be fetched needs --root.
    """
    records = []
    for name, one in datasets().items():
        try:
            source = one.source
        except ConfigError as error:
            remark(f"The data set {name} cannot be used: {error}")
            continue
        records.append(
            {
                "name": name, "sensor": one.mapping.sensor.name, "measured": source.measured,
                "task": ", ".join(source.tasks), "MB": round(source.bytes / 1e6, 1), "files": len(source.files),
                "from": source.address, "licence": source.licence, "citation": source.citation,
                "cached": one.imported.is_dir(), "needs": "" if source.address or one.imported.is_dir() else "--root",
            }
        )  # fmt: skip
    shown = ("name", "sensor", "measured", "task", "MB", "licence", "citation", "cached", "needs")
    print_records(records, shape, title="data sets", columns=shown)
    remark(f"Folder of fetched data sets: {cache()}")
