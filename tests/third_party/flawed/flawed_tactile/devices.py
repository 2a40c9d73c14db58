"""Force sensors and motors with one flaw each, on the pad's line."""

from flawed_tactile import line
from tactbench.plugin import Block, ChannelSpec, Quality, StreamSpec, hookimpl
from tactbench.plugin.devices import DeviceDescriptor

TACTBENCH_API = 2
AXES = ("fx", "fy", "fz")
LARGEST_N = 50.0
NANOMETRES = 1e-9


class Scale(line.Pad):
    """Sends forces in whole millinewtons, up to its range's end."""

    def __init__(self, settings):
        super().__init__(settings)
        sensed = self._senses
        self._senses = lambda t_s: {
            name: 1e3 * min(max(sensed(t_s).get(name, 0.0), -LARGEST_N), LARGEST_N) for name in AXES
        }


class Stage(line.Pad):
    """Sends the position of a motor in nanometres; told ``run``, it begins to move."""

    def __init__(self, settings):
        super().__init__(settings)
        self._runs = False
        self._senses = lambda t_s: {"position": 1e6 * t_s if self._runs else 0.0}

    def feed(self, piece, now_s):
        self._runs |= b"run" in bytes(piece)
        return super().feed(piece, now_s)


class ScaleDriver(line.PadDriver):
    unit, kind, newtons = "N", "force", 1e-3
    end_n = LARGEST_N

    def __init__(self, settings):
        super().__init__(settings)
        channels = tuple(ChannelSpec(name=name, kind=self.kind, unit=self.unit) for name in AXES)
        self._streams = (StreamSpec(name="force_torque", rate_hz=100.0, channels=channels),)
        self._zero = [0.0] * len(AXES)
        self._last = self._zero

    def blocks(self, rows, t_ns):
        rows = [[self.newtons * count for count in row] for row in rows]
        found = super().blocks([[n - zero for n, zero in zip(row, self._zero, strict=True)] for row in rows], t_ns)
        self._last = rows[-1] if rows else self._last
        return [self.marked(block) for block in found]

    def marked(self, block):
        marks = Quality.SATURATED * (abs(block.data) >= self.end_n).astype("uint8")
        return Block(block.stream, block.t_ns, block.data, quality=marks, sequence=block.sequence)

    def tare(self):
        self._zero = self._last
        return True


class StageDriver(line.PadDriver):
    unit = "m"
    metres = NANOMETRES

    def __init__(self, settings):
        super().__init__(settings)
        self._streams = (
            StreamSpec(name="motor", channels=(ChannelSpec(name="position", kind="position", unit=self.unit),)),
        )

    def blocks(self, rows, t_ns):
        return super().blocks([[self.metres * count for count in row] for row in rows], t_ns)


class shows_no_force(ScaleDriver):
    kind = "other"


class is_in_millinewtons(ScaleDriver):
    unit = "mN"


class is_in_grams(ScaleDriver):
    newtons = 0.101972


class turns_the_sign(ScaleDriver):
    newtons = -1e-3


class swaps_axes(ScaleDriver):
    def blocks(self, rows, t_ns):
        return super().blocks([row[::-1] for row in rows], t_ns)


class keeps_its_zero(ScaleDriver):
    def tare(self):
        return True


class hides_its_end(ScaleDriver):
    end_n = 1e9


class is_in_millimetres(StageDriver):
    unit = "mm"


class shows_no_position(StageDriver):
    def __init__(self, settings):
        super().__init__(settings)
        (channel,) = self._streams[0].channels
        channel = channel.model_copy(update={"kind": "other"})
        self._streams = (self._streams[0].model_copy(update={"channels": (channel,)}),)


class runs_off(StageDriver):
    def start(self):
        self._link.write(b"run\n")
        super().start()


def mixed(name, own):
    return type(name, (getattr(line, name), own), {})


SCALES = (
    "shows-no-force", "is-in-millinewtons", "is-in-grams", "turns-the-sign", "swaps-axes", "keeps-its-zero",
    "hides-its-end",
)  # fmt: skip
STAGES = ("is-in-millimetres", "shows-no-position", "runs-off")
LINES = ("opens-two-lines", "is-a-number", "goes-back-in-time", "doubles-samples", "waits-anyhow",
         "leaves-its-line-open", "hides-the-unplugging", "takes-any-option")  # fmt: skip
"""Of drivers of any device."""
globals().update({f"scale_{name}": mixed(name, ScaleDriver) for name in (one.replace("-", "_") for one in LINES)})


@hookimpl
def tactbench_devices():
    def device(name, code, kind):
        here = "flawed_tactile.devices"
        return DeviceDescriptor(
            name=name, title="A device on a line", kind=kind, driver=f"{here}:{code.replace('-', '_')}",
            emulator=f"{here}:{'Scale' if kind == 'force' else 'Stage'}", emulated_link="bytes",
        )  # fmt: skip

    return [
        device("sound-scale", "ScaleDriver", "force"),
        device("scale-is-not-at-that-address", "ScaleDriver", "force"),
        device("sound-stage", "StageDriver", "motor"),
        *(device(f"scale-{name}", name, "force") for name in SCALES),
        *(device(f"scale-{name}", f"scale-{name}", "force") for name in LINES),
        *(device(f"stage-{name}", name, "motor") for name in STAGES),
    ]
