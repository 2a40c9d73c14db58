"""``tactbench record``: records one scene into one file."""

from __future__ import annotations

import time
from pathlib import Path

import click

from tactbench.core.acquisition import acquire
from tactbench.core.cli.live import LiveView
from tactbench.core.cli.options import SIMULATION, YES
from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.plugins.interfaces import RecordingRequest, Rig
from tactbench.core.plugins.registry import load_registry
from tactbench.core.plugins.rigs import load_rig_file, rig_of
from tactbench.core.provenance import gather
from tactbench.core.recording.image import require_free
from tactbench.core.recording.reader import read_meta
from tactbench.core.study.operator import TerminalOperator
from tactbench.core.study.scenes import scene_of
from tactbench.core.study.simulation import simulation_of
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import command_line


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
