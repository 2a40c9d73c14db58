"""The controller at the end of its line: jogs at constant speed, homing to 0, reset; no kinder than GRBL 1.1 is.

It starts in alarm, answers nothing while it is homed, and `ok` at the end; after a reset it sends its banner and has lost
its place.
"""

import math

TICK_S = 1e-3
BANNER = "Grbl 1.1h ['$' for help]"


class GrblEmulator:
    """One axis, 0.2 mm from where it is homed; `settings` are those of `$$`."""

    def __init__(self, settings):
        self._sign, self._home_m = settings.options.get("sign", -1), settings.options.get("home_m", 0.0)
        self.settings = {"10": "1", "13": "0", "20": "1", "22": "1", "132": "200"}
        self.deaf_to = b""  # bytes that are lost on their way
        self._at_mm, self._to_mm, self._mm_s, self._state, self._now_s = -0.2, -0.2, 0.0, "Alarm", 0.0
        self._text, self._out = b"", []

    @property
    def position_m(self):
        """As the driver counts."""
        return self._home_m + self._sign * 1e-3 * self._at_mm

    def press_against(self, force_n):
        """A stepper is not moved by a force."""

    def restart(self, state="Alarm"):
        """Start anew, as by a reset or a dip of its supply: it stands, and counts from here."""
        self._home_m, self._at_mm, self._to_mm = self.position_m, 0.0, 0.0
        self._text, self._state = b"", state if self.settings["22"] == "1" else "Idle"
        self._say(BANNER)

    def feed(self, piece, now_s):
        """Take bytes; single ones are carried out at once, lines at their end."""
        self.poll(now_s)
        for byte in piece:
            if byte in self.deaf_to:
                continue
            if byte == 0x18:
                self.restart()
            elif byte == 0x85:
                self._to_mm = self._at_mm if self._state == "Jog" else self._to_mm
            elif byte == ord("?"):
                if self._state != "Home":
                    self._say(self._status())
            elif byte == ord("\n"):
                self._line(self._text.decode())
                self._text = b""
            else:
                self._text += bytes([byte])
        return self.poll(now_s)

    def _status(self):
        per_unit = 25.4 if self.settings["13"] == "1" else 1.0
        name = "MPos" if self.settings["10"] == "1" else "WPos"
        return f"<{self._state}|{name}:0.000,0.000,{self._at_mm / per_unit:.3f}|FS:0,0>"

    def _line(self, line):
        if line == "$$":
            for name, value in self.settings.items():
                self._say(f"${name}={value}")
            self._say("ok")
        elif line == "$H" and self.settings["22"] == "1":  # its `ok` comes at the end
            self._to_mm, self._mm_s, self._state = 0.0, 0.1, "Home"
        elif line == "$X":
            self._state = "Idle"
            self._say("ok")
        elif not line.startswith("$J="):
            self._state = "Sleep" if line == "$SLP" else self._state
            self._say("ok" if line == "$SLP" else "error:5")
        elif self._state not in ("Idle", "Jog"):
            self._say("error:9")
        else:
            to, rate = map(float, line.partition("Z")[2].split("F"))
            if not -float(self.settings["132"]) <= to <= 0.0:
                self._say("error:15")
            else:
                self._to_mm, self._mm_s, self._state = to, rate / 60, "Jog"
                self._say("ok")

    def _say(self, text):
        self._out.append((self._now_s + TICK_S, text.encode() + b"\r\n"))

    def poll(self, now_s):
        """Go on to a second; return what has left by then."""
        way, self._now_s = self._mm_s * (now_s - self._now_s), now_s
        self._at_mm += math.copysign(min(way, abs(self._to_mm - self._at_mm)), self._to_mm - self._at_mm)
        if self._at_mm == self._to_mm and self._state in ("Home", "Jog"):
            if self._state == "Home":
                self._say("ok")
            self._state = "Idle"
        sent = [piece for piece in self._out if piece[0] <= now_s]
        self._out = self._out[len(sent) :]
        return sent

    def next_s(self):
        """Return when something happens next."""
        moving = self._now_s + TICK_S if self._at_mm != self._to_mm else math.inf
        return min(moving, self._out[0][0] if self._out else math.inf)
