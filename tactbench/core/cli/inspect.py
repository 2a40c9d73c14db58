"""``tactbench inspect``: what is in a recording, and whether it is healthy."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import format_option
from tactbench.core.tables.text import json_text, visible

if TYPE_CHECKING:
    from tactbench.core.recording.reader import Recording

COLOURS = {"error": "red", "warning": "yellow", "info": "blue"}


@click.command(name="inspect")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@format_option("table", "json")
@click.option("--salvage", is_flag=True, help="Read an unfinished file (….partial), after a crash or while recording.")
@click.option("--rescue", type=click.Path(path_type=Path), metavar="OUT",
              help="Convert the one unfinished FILE into the recording OUT.")  # fmt: skip
@click.pass_context
def command(ctx: click.Context, files: tuple[Path, ...], shape: str, salvage: bool, rescue: Path | None) -> None:
    """Show what is in recordings: streams, channels, rates, and whether they are healthy.

    Exit code 1 if a finding is an error, 2 if a file cannot be read.
    """
    from tactbench.core.recording import salvage as unfinished
    from tactbench.core.recording.reader import open_recording

    if rescue is not None:
        if len(files) != 1:
            raise click.UsageError("--rescue OUT takes exactly one FILE.")
        unfinished.rescue(files[0], rescue)
        files = (rescue,)
    opened = unfinished.salvage if salvage and rescue is None else open_recording
    described = []
    for path in files:
        with opened(path) as recording:
            described.append(describe(recording))
        if shape == "table":
            _print(described[-1])
    if shape == "json":
        click.echo(json_text(described, indent=1))
    ctx.exit(1 if any(one["severity"] == "error" for about in described for one in about["findings"]) else 0)


def describe(recording: Recording) -> dict[str, Any]:
    """Return everything there is to know about an open recording but its samples, as plain data."""
    from dataclasses import asdict

    from tactbench.core.recording.health import examine

    findings = [asdict(finding) for finding in examine(recording)]
    meta = recording.meta
    own = {stream.name for stream in meta.sensor.streams}
    return {
        "file": str(recording.path),
        "complete": recording.complete,
        "content_sha256": recording.verify() if recording.complete else recording.content_digest(),
        "meta": meta.model_dump(mode="json", exclude={"sensor", "reference"}),
        "sensor": meta.sensor.name,
        "streams": [
            {"of": "sensor" if name in own else "reference", **_stream(recording, name)}
            for name in recording.stream_names
        ],
        "findings": findings,
    }


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
        "stream": name,
        "rows": len(stream),
        "dtype": stream.spec.dtype,
        "seconds": seconds,
        "mean_rate_hz": rate,
        "stated_rate_hz": stream.spec.rate_hz,
        "channels": [{"kind": kind, "unit": unit, "names": names} for (kind, unit), names in kinds.items()],
        "annotations": sorted(stream.annotations),
    }


def _print(about: dict[str, Any]) -> None:
    click.secho(visible(about["file"]), bold=True)
    for text in _lines(about):
        click.echo(f"  {visible(text)}")
    for finding in about["findings"]:
        click.secho(f"  {finding['severity']}: ", fg=COLOURS[finding["severity"]], nl=False)
        click.echo(visible(finding["message"]))
    if not about["findings"]:
        click.echo("  healthy: nothing was found")
    if not about["complete"]:
        click.echo("  unfinished: this is what a crash left behind")
    click.echo(f"  content {about['content_sha256'][:16]}{' (verified)' if about['complete'] else ''}")


def _lines(about: dict[str, Any]) -> Iterator[str]:
    """Yield what a recording is, of what, and how it was made."""
    meta = about["meta"]
    texts = [f"session {meta['session']}", f"clock {meta['clock']}"]
    texts += [f"{name} {meta[name]}" for name in ("trial", "role") if meta[name]]
    mark = " (EMULATED)" if meta["emulation"] else " (SIM)" if meta["simulated"] else ""
    yield f"{about['sensor']} on {meta['rig']}{mark}; {'; '.join(texts)}"
    for stream in about["streams"]:
        rate = "no rate"
        if stream["mean_rate_hz"]:
            rate = f"{stream['mean_rate_hz']:.4g} Hz over {stream['seconds']:.4g} s"
        channels = "; ".join(
            f"{len(one['names'])} {one['kind']} [{one['unit']}] {_ends(one['names'])}" for one in stream["channels"]
        )
        notes = f"; labels {', '.join(stream['annotations'])}" if stream["annotations"] else ""
        yield f"{stream['stream']} ({stream['of']}): {stream['rows']} rows, {rate}, {channels}{notes}"
    for name, clock in meta["clocks"].items():
        yield f"clock of {name}: {_clock(clock)}"
    if meta["emulation"]:
        yield f"emulated: {_emulation(meta['emulation'])}"
    plan = {taken: [one["effect"] + " (asked)" * one["asked"] for one in meta["plan"] if one["included"] == taken]
            for taken in (True, False)}  # fmt: skip
    pairs = {title: [f"{name} = {value}" for name, value in meta[key].items()]
             for title, key in (("labels", "labels"), ("assumed", "assumptions"))}  # fmt: skip
    for title, words in {"effects": plan[True], "left out": plan[False], **pairs}.items():
        if words:
            yield f"{title}: {', '.join(words)}"
    yield from (f"remark: {remark}" for remark in meta["remarks"])


def _clock(clock: dict[str, Any]) -> str:
    """Return one line: whose it is, how it was put on the host's, and how well."""
    text = str(clock["source"])
    lines = clock["segments"]
    if lines:
        drifts = [line["drift"] * 1e6 for line in lines]
        bounds = [line["bound_ns"] for line in lines]
        within = "no bound" if None in bounds else f"within {max(bounds) * 1e-6:.3g} ms"
        drift = f"drift {min(drifts):.3g} to {max(drifts):.3g} ppm"
        text += f", on the host's by {clock['method']} ({len(lines)} lines, {drift}, {within})"
    if any(clock["delay_ns"]):
        low, high = (edge * 1e-6 for edge in clock["delay_ns"])
        text += f"; least delay {low:.3g} to {high:.3g} ms, not taken off"
    return text + "".join(f"; {name}: {clock[name]}" for name in ("wraps", "breaks") if clock[name])


def _emulation(emulation: dict[str, Any]) -> str:
    factor = f" (factor {emulation['factor']:.3g})" if emulation["factor"] else ""
    moved = f", moved by {emulation['physics']}" if emulation["physics"] else ""
    faults = "".join(f"; fault {fault}" for fault in emulation["faults"])
    devices = ", ".join(emulation["devices"]) or "devices"
    return f"{devices} in {emulation['time']} time{factor}{moved}, seed {emulation['seed']}{faults}"


def _ends(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]}"
