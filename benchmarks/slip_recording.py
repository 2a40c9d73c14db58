"""What a recording of a slip costs: seconds of one core for a second of the recording.

A 10 s drag over a BioTac with PAC at 2.2 kHz, electrodes at 100 Hz and the reference at 500 Hz, single-threaded: from
the scene to its last block, the contact solved anew every time (every recording has its own placement). Then the whole
slip campaign, recording by recording into files, as a run makes it. Median of the rounds; below 1 is faster than real
time.

Usage: OMP_NUM_THREADS=1 python benchmarks/slip_recording.py [ROUNDS]
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

from threadpoolctl import threadpool_limits

from tactbench.core.acquisition import acquire
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.plugins.registry import load_registry
from tactbench.plugin import RigContext, load_object
from tactbench.tasks.slip_scenes import SLIP_SCENES

SECONDS = 10.0


def main(rounds: int = 5) -> None:
    """Print seconds per second of the drag, and seconds of the campaign for either sensor."""
    registry = load_registry()
    rig = load_object(registry.rigs["twin"].where)(RigContext(effects=tuple(registry.effects)))
    scene = next(one.scene for one in SLIP_SCENES if one.scene.labels["event"] == "slip")
    times = (*scene.profile.times_s[:-1], SECONDS)
    scene = scene.model_copy(
        update={"profile": scene.profile.model_copy(update={"times_s": times, "samples": round(500 * SECONDS)})}
    )
    spent = []
    for number in range(rounds + 1):
        # A session of its own is a placement of its own.
        own = scene.model_copy(update={"session": str(number)})
        began = time.perf_counter()
        with rig.open(registry.sensors["biotac"], own, seed=1) as acquisition:
            rows = sum(len(block.t_ns) for block in acquisition if block.stream == "vibration")
        spent.append(time.perf_counter() - began)
    assert rows == 2200 * SECONDS
    warm = statistics.median(spent[1:])
    print(f"a drag of {SECONDS:g} s on the BioTac: {warm / SECONDS:.4f} s per second (first: {spent[0] / SECONDS:.4f})")
    whole_s = sum(one.scene.profile.duration.to("s") for one in SLIP_SCENES)
    for sensor in ("biotac", "icub"):
        began, busy = time.perf_counter(), time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            for one in SLIP_SCENES:
                path = Path(folder) / f"{one.scene.name}.h5"
                described = registry.sensors[sensor], registry.rigs["twin"]
                acquire(rig, RecordingRequest(*described, one.scene, path, 1, one.role), clock=time.monotonic)
        spent_s, busy_s = time.perf_counter() - began, time.process_time() - busy
        print(
            f"the campaign on {sensor}: {len(SLIP_SCENES)} recordings of {whole_s:.0f} s in {spent_s:.1f} s, "
            f"{busy_s:.1f} s of one core"
        )


if __name__ == "__main__":
    with threadpool_limits(1):
        main(*(int(word) for word in sys.argv[1:]))
