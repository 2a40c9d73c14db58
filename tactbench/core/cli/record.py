"""``tactbench record``: records one scene into one file."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import click

from tactbench.core.acquisition import acquire
from tactbench.core.cli.shared import SIMULATION, YES
from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Acquisition, RecordingRequest, Rig
from tactbench.core.plugins.registry import load_registry
from tactbench.core.plugins.rigs import load_rig_file, rig_of
from tactbench.core.provenance import gather
from tactbench.core.recording.image import require_free
from tactbench.core.recording.reader import read_meta
from tactbench.core.samples import Block
from tactbench.core.spec import units
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import StreamSpec
from tactbench.core.study.options import scene_of, simulation_of
from tactbench.core.study.terminal import TerminalOperator
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import command_line


class LiveView:
    """A line on stderr during a recording, if `drawn`; its last state stays at the end of the ``with`` block.

    `acquire` calls :meth:`begin` and :meth:`watch`. A separate thread draws, so that a slow terminal delays
    no recording.
    """

    def __init__(self, scene: Scene, title: str, *, drawn: bool = True) -> None:
        from rich.console import Console

        self.line = f"{title}: waiting for samples"
        """The line as it was last updated."""
        self._scene = scene
        self._title = title
        self._drawn = drawn
        self._status = Console(stderr=True, highlight=False).status(self.line)
        self._streams: dict[str, StreamSpec] = {}
        self._rows = Counter[str]()
        self._force = "-"
        self._began_ns = self._last_ns = 0

    def begin(self, acquisition: Acquisition) -> None:
        """Start drawing the line for the streams of `acquisition`."""
        self._streams = {spec.name: spec for spec in (*acquisition.streams, *acquisition.reference)}
        if self._drawn:
            self._status.start()

    def watch(self, block: Block) -> None:
        """Count the rows of a block, note its newest force, and update the line; no reference to the block is kept."""
        import numpy as np
        from rich.text import Text

        if not self._drawn or block.stream not in self._streams or block.t_ns is None or not len(block.t_ns):
            return
        if not self._rows:
            self._began_ns = int(block.t_ns[0])
        self._rows[block.stream] += len(block.data)
        self._last_ns = max(self._last_ns, int(block.t_ns[-1]))
        for column, channel in enumerate(self._streams[block.stream].channels):
            if channel.kind == "force" and channel.name in ("normal", "fz"):
                self._force = f"{block.data[-1, column] * units.conversion(channel.unit, 'N'):.2f}"
        profile, elapsed_s = self._scene.profile, (self._last_ns - self._began_ns) * 1e-9
        rates = [f"{name} {elapsed_s and self._rows[name] / elapsed_s:.4g} Hz" for name in self._streams]
        self.line = (
            f"{self._title}: {elapsed_s:.1f} of {profile.duration.to('s'):.1f} s, force {self._force} N, planned "
            f"{np.interp(elapsed_s, *profile.corners):.2f} N; {', '.join(rates)}"
        )
        self._status.update(Text(self.line))

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which the line is hidden, so that a prompt can use the terminal."""
        self._status.stop()
        try:
            yield
        finally:
            if self._streams and self._drawn:
                self._status.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._status.stop()
        if self._drawn:
            remark(self.line)


@click.command(name="record")
@click.option("--sensor", required=True, metavar="NAME", help="Sensor.")
@click.option("--rig", metavar="NAME", help="Rig. Default: the rig file's, else twin.")
@click.option("--rig-file", metavar="FILE", help="Devices and links of a rig of real or emulated devices.")
@click.option("--indenter", metavar="NAME[:D=X,...]",
              help="Indenter with dimensions: cap:radius=10, cylinder:radius=4,angle=90. Default: flat.")  # fmt: skip
@click.option("--profile", metavar="NAME[:P=X,...]",
              help="Force profile with its parameters: ramp:force=5,duration=60 (the default), "
                   "sine:mean=2,frequency=0.5.")  # fmt: skip
@SIMULATION
@click.option("--seed", type=click.IntRange(min=0), default=1, metavar="N", help="Random seed.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="FILE", help="Output file (.h5).")
@YES
@click.option("--live", is_flag=True, help="Show force, planned force and rates while recording.")
def command(
    sensor: str, rig: str | None, rig_file: str | None, indenter: str | None, profile: str | None, effects: str | None,
    settings: tuple[str, ...], seed: int, out: Path, yes: bool, live: bool,
) -> None:  # fmt: skip
    """Record one scene into one file; `tactbench list` names indenters and profiles."""
    registry = load_registry()
    descriptor = registry.sensors[sensor]
    scene = scene_of(registry, descriptor, indenter, profile)
    devices = load_rig_file(Path(rig_file), registry) if rig_file else None
    rig = rig or (devices.rig if devices else registry.first_rig("simulated"))
    scene = scene.simulated_as(simulation_of(registry, rig, [sensor], effects, settings))
    require_free(out)
    if registry.rigs[rig].replays:
        raise UsageError(
            f"The rig {rig!r} cannot record: it only replays recordings that exist already.",
            hint="Use --rig twin, or another rig that records.",
        )
    try:
        with LiveView(scene, f"{sensor} on {rig}, {scene.indenter}", drawn=live) as view:
            operator = TerminalOperator(yes=yes, paused=view.paused)
            built: Rig = rig_of(rig, registry, None, devices, operator)  # type: ignore[assignment]
            request = RecordingRequest(
                descriptor, registry.rigs[rig], scene, out, seed, rig_file=devices, name=out.stem,
                provenance=gather(registry),
            )  # fmt: skip
            meta = acquire(built, request, clock=time.perf_counter, opened=view.begin, watch=view.watch,
                           complete_interrupted=True)  # fmt: skip
    except (KeyboardInterrupt, TactbenchError) as error:
        if out.exists() and read_meta(out).excluded.startswith("interrupted"):
            remark(f"The samples recorded until the interruption are in {out}, which is left out of every evaluation.")
        elif isinstance(error, KeyboardInterrupt):
            remark("\n".join(getattr(error, "__notes__", ())) or "No recording was kept.")
        raise
    mark = " (EMULATED)" if meta.emulation else " (SIM)" if meta.simulated else ""
    click.echo(f"{out}: {sensor} on {rig}{mark}, {scene.indenter}")
    for name, value in meta.assumptions.items():
        remark(f"  assumed: {name} = {value}")
    remark(f"See its contents:  {command_line('tactbench', 'inspect', str(out))}")
    if meta.excluded:
        remark(f"This recording is left out of scores unless --include-incomplete is given: {meta.excluded}.")
        click.get_current_context().exit(1)
