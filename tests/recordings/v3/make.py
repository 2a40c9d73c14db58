"""How ``press.h5`` beside this file was made: once, by format version 3. It is never written anew.

Taxels with a clock of their own, lost once and begun again, with a gap; the force on the host's clock.

Usage: python tests/recordings/v3/make.py FILE
"""

import sys
from pathlib import Path

import numpy as np

from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.quantity import Source
from tactbench.core.spec.recording import Emulation, PlanEntry, RecordingMeta, StreamClock, StreamCounts
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

ROWS = 180
TAXELS = StreamSpec(
    name="taxels", dtype="uint16", rate_hz=100.0, rate_source=Source(tag="assumed", reference="made for a test"),
    channels=tuple(ChannelSpec(name=f"t{place}", kind="taxel", lower=0, upper=4095) for place in range(3)),
)  # fmt: skip
FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))


def main(path: Path) -> None:
    """Write it."""
    rng = np.random.default_rng(20160507)
    n = np.arange(ROWS, dtype=np.int64)
    true = 1_000_000_000_000 + n * 10_000_000
    device = np.where(n < 100, n, n - 100) * 10_000_000
    host = true + 200_000 + rng.exponential(500_000, ROWS).astype(np.int64)
    quality = np.zeros((ROWS, 3), dtype=np.uint8)
    quality[40] = Quality.GAP
    quality[41, 1] = Quality.GAP | Quality.SUSPECT
    sensor = SensorSpec(
        name="pad", title="a pad", principle="capacitive",
        principle_source=Source(tag="assumed", reference="made for a test"), streams=(TAXELS,),
    )  # fmt: skip
    meta = RecordingMeta(
        name="press", sensor=sensor, reference=(FORCE,), rig="bench", simulated=True, clock="host", session="a",
        role="test", emulation=Emulation(time="real", seed=1, physics="twin", devices=("pad",)),
        clocks={
            "taxels": StreamClock(source="device", delay_ns=(200_000, 300_000), wraps=1),
            "force_torque": StreamClock(source="host"),
        },
        streams={"taxels": StreamCounts(received=183, written=180, dropped=2, duplicates=1, gaps=3)},
        counts={"pad parity errors": 1},
        plan=(PlanEntry(effect="creep", included=False, reason="made for a test", change=0.25),),
        drawn={"solver_residual": 1e-9},
    )  # fmt: skip
    data = rng.integers(0, 4096, (ROWS, 3)).astype(np.uint16)
    with RecordingWriter(path, meta) as writer:
        for rows in np.array_split(n, 9):
            writer.append(
                Block("taxels", host[rows], data[rows], quality[rows], sequence=n[rows], device_ns=device[rows])
            )
            writer.append(Block("force_torque", true[rows], np.linspace(0, 5, ROWS)[rows, None]))
        writer.annotate("taxels", "object", ["ball"] * 100 + ["Bär"] * 80)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
