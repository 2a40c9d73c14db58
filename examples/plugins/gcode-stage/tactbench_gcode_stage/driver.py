"""A stage with GRBL as a Positioner: every move is a jog, which can be cancelled at any moment."""

import math
import re

from tactbench.plugin.devices import Positioner, PositionerError, PositionerOptions

JOG_CANCEL, RESET = b"\x85", b"\x18"
PLACE = re.compile(rb"<(\w+).*\|MPos:([-.\d]+),([-.\d]+),([-.\d]+)")


class GcodeOptions(PositionerOptions):
    """Which axis, and -1 where pressing makes its coordinate fall."""

    axis: str = "Z"
    sign: int = -1


class GcodeStage(Positioner):
    """One axis; positions are its machine coordinates in m, times the sign, from `home_m` on."""

    device, options_kind = "gcode-stage", GcodeOptions
    resolution_m, stop_latency_s = 1e-6, 0.03  # GRBL's status has a micrometre
    address = "serial:///dev/ttyACM0?baud=115200"
    status = b""

    def home(self, stop=lambda: False):
        """Run the homing cycle of the controller, which moves as it is set up to."""
        self._send(b"$H\n", math.inf)  # ends with an answer
        self.finish(stop)
        self.homed = self.enabled = True

    def find_home(self):
        """Whether the controller stands ready: it begins in alarm, which homing ends."""
        self.update(0.5)
        self.homed = self.enabled = self.status == b"Idle"
        return self.homed

    def disable(self):
        """Let the controller sleep, without power."""
        self._send(b"$SLP\n")
        self.enabled = self.homed = False

    def move_to(self, position, speed=None):
        """Jog to a place."""
        self.check_move(position)
        at_mm = 1e3 * self.options.sign * (position - self.options.home_m)
        mm_min = 6e4 * (speed or self.facts.speed)
        self._send(b"$J=G53G21%s%.3fF%.1f\n" % (self.options.axis.encode(), at_mm, mm_min), round(position, 6))
        return round(position, 6)

    def halt(self):
        """Cancel the jog; homing ends with a reset alone."""
        self._send(RESET if self.status == b"Home" else JOG_CANCEL)

    def update(self, timeout_s=0.0):
        """Ask for the status, and take what has come."""
        for line in self.lines(b"?", timeout_s):
            if line.startswith((b"error", b"ALARM")):
                raise PositionerError(f"The stage says {line!r}.")
            if line.startswith(b"ok") and self._goal == math.inf:
                self.begin()
            elif place := PLACE.match(line):
                self.answered()
                self.status = place[1]
                at_m = 1e-3 * self.options.sign * float(place[2 + "XYZ".index(self.options.axis)])
                self.see(self.clock(), self.options.home_m + at_m, idle=self.status == b"Idle")

    def _send(self, command, target=math.nan):
        self.link.write(command)
        self.begin(target)
