"""A stage with GRBL as a Positioner: every move is a jog, which can be cancelled at any moment."""

import math
import re

from tactbench.plugin.devices import Positioner, PositionerError, PositionerOptions, PositionerSilentError

JOG_CANCEL, RESET = b"\x85", b"\x18"
STATUS = re.compile(rb"<(\w+)[^|>]*\|(?:MPos:([-.\d]+),([-.\d]+),([-.\d]+))?")
NEEDED = {b"$13=0": "positions in mm", b"$20=1": "soft limits", b"$22=1": "homing"}
BOOTS = 6  # a board that starts anew when its port is opened answers after some 2 s; each question waits for 0.5 s


class GcodeOptions(PositionerOptions):
    """Which axis, and -1 where pressing makes its coordinate fall."""

    axis: str = "Z"
    sign: int = -1


class GcodeStage(Positioner):
    """One axis; positions are its machine coordinates in m, times the sign, from `home_m` on."""

    device, options_kind = "gcode-stage", GcodeOptions
    resolution_m, stop_latency_s = 1e-6, 0.03  # GRBL's status has a micrometre
    address = "serial:///dev/ttyACM0?baud=115200"

    def start(self):
        """Read the controller's settings, and ask for its state."""
        found, tries = [], 0
        while b"ok" not in found:
            try:
                found += [line.strip() for line in self.lines(b"$$\n", 0.1)]
            except PositionerSilentError:
                tries += 1
                if tries == BOOTS:
                    raise
        self.answered()
        if lacking := [f"{setting.decode()} ({what})" for setting, what in NEEDED.items() if setting not in found]:
            raise PositionerError(f"The controller is not set up with {', '.join(lacking)}.", hint="Set it up so.")
        super().start()

    def home(self, stop=lambda: False):
        """Run the homing cycle of the controller, which moves as it is set up to, and says nothing until its `ok`."""
        self.homed = False
        while self.lines(b"", 0.05):  # an `ok` of what was before is none of homing
            self.answered()
        self._send(b"$H\n", math.inf)
        self.finish(stop)
        self.homed = self.enabled = True

    def disable(self):
        """Let the controller sleep, without power."""
        self._send(b"$SLP\n")
        self.enabled = self.homed = False

    def move_to(self, position, speed=None):
        """Jog to a place."""
        self.check_move(position)
        at_mm, speed = 1e3 * self.options.sign * (position - self.options.home_m), speed or self.facts.speed
        jog = b"$J=G53G21%s%.3fF%.1f\n" % (self.options.axis.encode(), at_mm, 6e4 * speed)
        self._send(jog, round(position, 6), speed)
        return round(position, 6)

    def halt(self):
        """Cancel the jog; homing ends with a reset alone."""
        self._send(RESET if self._homing else JOG_CANCEL)

    def halt_harder(self):
        """Reset the controller, which then does not know its place."""
        self.homed = False
        self._send(RESET)

    def update(self, timeout_s=0.0):
        """Ask for the status, unless it is homed, and take what has come."""
        for line in self.lines(b"" if self._homing else b"?", timeout_s):
            if line.startswith(b"ok") and self._homing:
                self.begin()
            elif status := STATUS.match(line):
                self.answered()
                if status[2] is None:
                    raise PositionerError(f"The stage says {line!r}, and MPos is expected.", hint="Set $10=1.")
                at_m = 1e-3 * self.options.sign * float(status[2 + "XYZ".index(self.options.axis)])
                self.see(self.clock(), self.options.home_m + at_m, idle=status[1] not in (b"Jog", b"Home", b"Run"))
                if status[1] not in (b"Idle", b"Jog"):
                    self._lost(line)
            elif line.startswith((b"error", b"ALARM", b"Grbl")):
                self._lost(line)
                raise PositionerError(f"The stage says {line!r}.")

    @property
    def _homing(self):
        return self.moving and self._goal == math.inf

    def _lost(self, line):
        """Believe no place any more; raise PositionerError where one was believed."""
        was, self.homed = self.homed, self.homed and line.startswith(b"error")
        if was and not self.homed:
            raise PositionerError(f"The stage says {line!r}: its place is not known any more.", hint="Home it anew.")

    def _send(self, command, target=math.nan, speed=None):
        self.link.write(command)
        self.begin(target, speed)
