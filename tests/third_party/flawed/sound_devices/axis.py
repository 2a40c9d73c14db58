"""An axis that takes lines: `H` homes it, `G 1200 500` sends it to 1.2 mm at 0.5 mm/s, `S` halts it, `?` asks."""

import math

from tactbench.plugin.devices import Positioner, PositionerError

TICK_S, BRAKE_S, PULL_M = 1e-3, 0.05, 0.5e-3


class Axis(Positioner):
    device, resolution_m = "sound-axis", 1e-6
    stop_latency_s = 0.06

    def start(self):
        self.link.discard()  # the answer to what was asked before
        self.answered()
        super().start()

    def home(self, stop=lambda: False):
        self.homed = False
        self._send(b"H\n")
        self.begin(self.options.home_m)  # an answer from before it moves says that it stands
        self.finish(stop)
        self.homed = self.enabled = True

    def disable(self):
        self.enabled = False

    def move_to(self, position, speed=None):
        self.check_move(position)
        steps = round(1e6 * (position - self.options.home_m))
        self._send(b"G %d %d\n" % (steps, round(1e6 * (speed or self.facts.speed))))
        self.begin(self.options.home_m + 1e-6 * steps)
        return self._goal

    def halt(self):
        self._send(b"S\n")

    def update(self, timeout_s=0.0):
        for line in self.lines(b"?\n", timeout_s):
            kind, steps = line.split()
            if kind == b"E":
                raise PositionerError("The axis says that it cannot.")
            self.answered()
            self.see(self.clock(), self.options.home_m + 1e-6 * int(steps), idle=kind == b"I")

    def _send(self, command):
        self.link.write(command)
        self.begin()


class AxisEmulator:
    """It begins 3 mm from its end stop, and brakes for a while; its answers take a tick."""

    def __init__(self, settings):
        self._home_m = settings.options.get("home_m", 0.0)
        self._at_m, self._to_m, self._speed, self._stop_s, self._now_s = 3e-3, 3e-3, 0.0, math.inf, 0.0
        self._text, self._out = b"", []

    @property
    def position_m(self):
        return self._home_m + self._at_m

    def press_against(self, force_n):
        """It is not moved by a force."""

    def feed(self, piece, now_s):
        self.poll(now_s)
        *lines, self._text = (self._text + piece).split(b"\n")
        for line in lines:
            match line.split():
                case [b"H"]:
                    self._to_m, self._speed = 0.0, 2e-3
                case [b"G", steps, speed]:
                    self._to_m, self._speed, self._stop_s = 1e-6 * int(steps), 1e-6 * int(speed), math.inf
                case [b"S"]:
                    self._stop_s = now_s + BRAKE_S
                case [b"?"]:
                    kind = "I" if self._at_m == self._to_m else "M"
                    self._out.append((now_s + TICK_S, f"{kind} {round(1e6 * self._at_m)}\n".encode()))
        return self.poll(now_s)

    def poll(self, now_s):
        way = self._speed * (min(now_s, self._stop_s) - min(self._now_s, self._stop_s))
        self._now_s = now_s
        self._at_m += math.copysign(min(way, abs(self._to_m - self._at_m)), self._to_m - self._at_m)
        if now_s >= self._stop_s:
            self._to_m, self._stop_s = self._at_m, math.inf
        sent = [piece for piece in self._out if piece[0] <= now_s]
        self._out = self._out[len(sent) :]
        return sent

    def next_s(self):
        moving = self._now_s + TICK_S if self._at_m != self._to_m else math.inf
        return min(moving, self._out[0][0] if self._out else math.inf)
