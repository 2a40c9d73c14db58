"""``tactbench inspect``: shows the contents of recordings and checks their health."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from tactbench.core.cli.shared import field_text, format_option, print_fields, print_records
from tactbench.core.recording.health import examine
from tactbench.core.recording.partial import rescue as convert
from tactbench.core.recording.reader import Recording, open_recording
from tactbench.core.tables.text import json_text

_COLUMNS = ("stream", "of", "rows", "mean_rate_hz", "stated_rate_hz", "seconds", "channels", "annotations")
_STRUCTURES = ("scene", "plan", "clocks", "streams", "drawn", "provenance")
"""Fields of a recording's metadata that the terminal shows in another form or not at all; JSON output has them."""


@click.command(name="inspect")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@format_option("table", "json")
@click.option("--salvage", is_flag=True, help="Show an unfinished FILE (….partial), also while it grows.")
@click.option("--rescue", type=click.Path(path_type=Path), metavar="OUT",
              help="Convert one FILE that is unfinished (….partial) into the recording OUT.")  # fmt: skip
@click.pass_context
def command(ctx: click.Context, files: tuple[Path, ...], shape: str, salvage: bool, rescue: Path | None) -> None:
    """Show the contents of recordings (streams, channels, rates), and check their health.

    Exit code 1 if a finding is an error, 2 if a file cannot be read.
    """
    if rescue is not None:
        if len(files) != 1:
            raise click.UsageError("--rescue OUT takes exactly one FILE.")
        convert(files[0], rescue)
        files = (rescue,)
    described = []
    for path in files:
        with ExitStack() as stack:
            shown = path
            if salvage and rescue is None:
                shown = Path(stack.enter_context(TemporaryDirectory())) / "salvaged.h5"
                convert(path, shown)
            described.append({**describe(stack.enter_context(open_recording(shown))), "file": str(path)})
        if shape == "table":
            _print(described[-1])
    if shape == "json":
        click.echo(json_text(described, indent=1))
    ctx.exit(1 if any(one["severity"] == "error" for about in described for one in about["findings"]) else 0)


def describe(recording: Recording) -> dict[str, Any]:
    """Return the metadata, streams and findings of an open recording as plain data, without its samples."""
    findings = [asdict(finding) for finding in examine(recording)]
    meta = recording.meta
    own = {stream.name for stream in meta.sensor.streams}
    return {
        "content_sha256": recording.verify(),
        "meta": meta.model_dump(mode="json", exclude={"sensor", "reference"}), "sensor": meta.sensor.name,
        "streams": [{"of": "sensor" if name in own else "reference", **_stream(recording, name)}
                    for name in recording.stream_names],
        "findings": findings,
    }  # fmt: skip


def _stream(recording: Recording, name: str) -> dict[str, Any]:
    stream = recording.stream(name)
    t_ns, seconds, rate = stream.times(), None, None
    if t_ns is not None and len(t_ns) > 1:
        seconds = float(t_ns[-1] - t_ns[0]) * 1e-9
        rate = (len(t_ns) - 1) / seconds if seconds > 0 else None
    kinds: dict[tuple[str, str], list[str]] = {}
    for channel in stream.spec.channels:
        kinds.setdefault((channel.kind, channel.unit), []).append(channel.name)
    return {
        "stream": name, "rows": len(stream), "dtype": stream.spec.dtype, "seconds": seconds, "mean_rate_hz": rate,
        "stated_rate_hz": stream.spec.rate_hz,
        "channels": [{"kind": kind, "unit": unit, "names": names} for (kind, unit), names in kinds.items()],
        "annotations": sorted(stream.annotations),
    }  # fmt: skip


def _print(about: dict[str, Any]) -> None:
    meta = about["meta"]
    effects = {taken: [one["effect"] + " (forced)" * one["asked"] for one in meta["plan"] if one["included"] is taken]
               for taken in (True, False)}  # fmt: skip
    stated: dict[str, Any] = {
        "file": about["file"], "sensor": about["sensor"],
        **{name: value for name, value in meta.items() if name not in _STRUCTURES},
        **{f"clock of {stream}": _clock(clock) for stream, clock in meta["clocks"].items()},
        "effects": effects[True], "left out": effects[False], "content": f"{about['content_sha256'][:16]} (verified)",
    }  # fmt: skip
    print_fields([(name, text) for name, value in stated.items() if (text := field_text(value))])
    click.echo()
    records = []
    for one in about["streams"]:
        texts = []
        for kind in one["channels"]:
            names = kind["names"]
            ends = ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]}"
            texts.append(f"{len(names)} {kind['kind']} [{kind['unit']}] {ends}")
        records.append({**one, "channels": "; ".join(texts)})
    print_records(records, "table", title="streams", columns=_COLUMNS)
    fields = [(finding["severity"], finding["message"]) for finding in about["findings"]]
    print_fields(fields or [("healthy", "nothing was found")])


def _clock(clock: dict[str, Any]) -> dict[str, Any]:
    """Return the summary of the fit of a device's clock to the host's; JSON output has every segment of the fit."""
    lines = clock["segments"]
    drift = max((line["drift"] * 1e6 for line in lines), key=abs, default=None)
    error_us = max((line["bound_ns"] * 1e-3 for line in lines if line["bound_ns"] is not None), default=None)
    return {"source": clock["source"], "method": clock["method"], "drift ppm": drift, "error us": error_us,
            "breaks": clock["breaks"]}  # fmt: skip
