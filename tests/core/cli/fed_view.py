"""A live view that is fed by the lines of a FIFO: a process for a terminal.

``force 2.5``: a tenth of a second of samples with that force; ``gap``: one with losses; ``burst 3000``: so many tenths
at once; ``busy 1.5``: tenths for so many seconds; ``ask``: the operator; ``end``. Each is answered on stdout.
"""

import sys
import time
from pathlib import Path

import numpy as np

from tactbench.core.cli.live import LiveView
from tactbench.core.cli.operator import TerminalOperator
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import sourced
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

PAD = StreamSpec(
    name="pad",
    rate_hz=100,
    channels=(
        *(
            ChannelSpec(name=f"t{n}", kind="taxel", lower=0, upper=4095, sign=-1, position_m=(n / 1e3, n % 2 / 1e3, 0))
            for n in range(1, 5)
        ),
        ChannelSpec(name="warmth", kind="dc_temperature", unit="degC"),
    ),
)
SCALE = StreamSpec(name="scale", rate_hz=1000, channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),))
RAMP = ForceRamp(
    end=sourced(5, "N", "test"), duration=sourced(10, "s", "test"), hold=sourced(1, "s", "test"), samples=1000
)
SCENE = Scene(name="fed", profile=RAMP)


class Fed:
    streams = (PAD,)
    reference = (SCALE,)

    def __init__(self, view):
        self.view = view
        self.tenths = self.lost = 0

    def tenth(self, force_n, *, lossy=False):
        """Give a tenth of a second: the pad falls by 100 counts a newton, its third taxel twice as much."""
        began_ns = self.tenths * 100_000_000 + 77
        self.tenths += 1
        pad = np.full((10, 5), 3000.0 - 100 * force_n)
        pad[:, 2] -= 100 * force_n
        pad[:, 4] = 31.25
        quality = None
        if lossy:
            quality = np.zeros((10, 5), np.uint8)
            quality[0] = Quality.GAP
            quality[-1, 0] = Quality.SATURATED
        self.lost += 7 * lossy
        numbers = np.arange(10) + 10 * self.tenths + self.lost
        self.view.watch(Block("pad", began_ns + np.arange(10) * 10_000_000, pad, quality, sequence=numbers))
        self.view.watch(Block("scale", began_ns + np.arange(100) * 1_000_000, np.full((100, 1), force_n)))


def main():
    with Path(sys.argv[1]).open() as commands, LiveView(SCENE, "pad on a test") as view:
        fed = Fed(view)
        view.begin(fed)
        print("begun", flush=True)
        for line in commands:
            what, *numbers = line.split()
            if what == "end":
                break
            if what == "force":
                fed.tenth(float(numbers[0]))
            elif what == "gap":
                fed.tenth(0.0, lossy=True)
            elif what == "burst":
                for _ in range(int(numbers[0])):
                    fed.tenth(1.0)
            elif what == "busy":
                until_s = time.monotonic() + float(numbers[0])
                while time.monotonic() < until_s:
                    fed.tenth(1.0)
            elif what == "ask":
                TerminalOperator(paused=view.paused).prompt("Place the cap.")
            print(what, flush=True)


if __name__ == "__main__":
    main()
