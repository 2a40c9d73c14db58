"""The controller at the end of its line: jogs at constant speed, jog cancel, homing to 0, status."""

import math

TICK_S = 1e-3


class GrblEmulator:
    """One axis; it begins in alarm, 0.2 mm from where it is homed."""

    def __init__(self, settings):
        self._sign, self._home_m = settings.options.get("sign", -1), settings.options.get("home_m", 0.0)
        self._at_mm, self._to_mm, self._mm_s, self._state, self._now_s = -0.2, -0.2, 0.0, "Alarm", 0.0
        self._text, self._out = b"", []

    @property
    def position_m(self):
        """As the driver counts."""
        return self._home_m + self._sign * 1e-3 * self._at_mm

    def press_against(self, force_n):
        """A stepper is not moved by a force."""

    def feed(self, piece, now_s):
        """Take bytes; single ones are carried out at once, lines at their end."""
        self.poll(now_s)
        for byte in piece:
            if byte == 0x85:
                self._to_mm = self._at_mm
            elif byte == ord("?"):
                self._say(f"<{self._state}|MPos:0.000,0.000,{self._at_mm:.3f}|FS:0,0>")
            elif byte == ord("\n"):
                self._say(self._line(self._text.decode()))
                self._text = b""
            else:
                self._text += bytes([byte])
        return self.poll(now_s)

    def _line(self, line):
        if line != "$H" and self._state == "Alarm":
            return "error:9"
        to, rate = ("0", "300") if line == "$H" else line.partition("Z")[2].split("F")
        self._to_mm, self._mm_s, self._state = float(to), float(rate) / 60, "Home" if line == "$H" else "Jog"
        return "ok"

    def _say(self, text):
        self._out.append((self._now_s + TICK_S, text.encode() + b"\r\n"))

    def poll(self, now_s):
        """Go on to a second; return what has left by then."""
        way, self._now_s = self._mm_s * (now_s - self._now_s), now_s
        self._at_mm += math.copysign(min(way, abs(self._to_mm - self._at_mm)), self._to_mm - self._at_mm)
        if self._at_mm == self._to_mm and self._state != "Alarm":
            self._state = "Idle"
        sent = [piece for piece in self._out if piece[0] <= now_s]
        self._out = self._out[len(sent) :]
        return sent

    def next_s(self):
        """Return when something happens next."""
        moving = self._now_s + TICK_S if self._at_mm != self._to_mm else math.inf
        return min(moving, self._out[0][0] if self._out else math.inf)
