"""Asked with ``id``, started with ``go``, stopped with ``stop``; each sample is a line of numbers."""

from tactbench.plugin import RigError
from tactbench.plugin.devices import ByteLink, LinkTimeout, RowDriver, Sample
from wired_tactile import PAD, SCALE


class LineDriver(RowDriver[ByteLink]):
    stream, link_kind = PAD, ByteLink
    _text = b""

    def identify(self):
        self.link.write(b"id\n")
        try:
            model, serial = self.link.read(1.0).data.decode().split()
        except LinkTimeout:
            raise RigError("It does not say who it is.", hint="Is it a wired device?") from None
        return {"model": model, "serial": serial}

    def begin(self):
        self._text = b""
        self.link.write(b"go\n")

    def rows(self, received):
        *lines, self._text = (self._text + received.data).split(b"\n")
        for line in lines:
            yield Sample([*map(float, line.split())])

    def quiet(self):
        self.link.write(b"stop\n")


class Scale(LineDriver):
    stream = SCALE


build, scale = LineDriver, Scale
