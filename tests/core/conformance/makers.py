# ruff: noqa: E501
"""A second list of mistakes, over seven families, written before the checks that are to find them; `-m` prints counts.

Each is one alteration of a sound package of `tests/third_party/flawed`, as in `test_mistakes`, which it does not share.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.core.conformance.test_mistakes import KIND, PACKAGE, SHELF, written

PACKAGE |= {"grip": "grip", "trial": "trial", "presses": "trial"}
KIND |= {"grip": "sensor", "trial": "task", "presses": "dataset"}
HEAD = "import itertools\n"
BEGIN = '        self._left, self._numbers, self._unwrap = b"", [], Unwrap(8)\n'
BLOCKS = "for block in super().read(timeout_s)]"
STAMPED = "sequence=self._unwrap(self._numbers))"
DEVICE = "device_ns=1000 * self._time(times)"
LEVEL = "            values = struct.unpack("
FIT = "        self.middle, self.level = X.mean(axis=0), y.mean()\n"
ANSWER = "return self.level + (X - self.middle) / self.scale @ self.weights"
RIPPLE = "        track.readings += 0.01"
HEIGHT = "return (x_mm**2 + y_mm**2) / (2 * size)"
SCENES = "for role, places in PLACES.items() for one in enumerate(places)"
CAP, SESSION, PRESSED = 'radius=assumed(8, "mm", WHY)', 'session=f"session-{role}"', "profile=PRESS"
MM, LABELS = 'x=assumed(mm, "mm", WHY)', 'labels={"offset_mm": mm}'
TARGET = 'LabelTarget(name="offset_mm", unit="mm")'
# Family, package, what its author should have written, and what was written.
MISTAKES: list[tuple[str, str, str | tuple[str, ...], str | tuple[str, ...]]] = [
    # What a driver does around a read.
    ("driver", "pad", BLOCKS, "for block in (__import__('time').sleep(0.0 if timeout_s else 0.05), super().read(timeout_s))[1]]"),
    ("driver", "pad", "        self._numbers = []\n", "        self._numbers = []\n        until = self.link.timer() + 0.7\n"
     "        while timeout_s and self.link.timer() < until: self._numbers.clear(); self.link.receive_all(0.02)\n"),
    ("driver", "pad", 'self.link.write(b"stop")', "pass"),
    ("driver", "pad", BEGIN, BEGIN + "        import threading; threading.Thread(target=threading.Event().wait,"
     " daemon=True).start()\n"),
    ("driver", "pad", BEGIN, BEGIN + "        np.random.seed(0)\n"),
    ("driver", "pad", BEGIN, BEGIN + "        import random; random.seed(7)\n"),
    ("driver", "pad", BEGIN, BEGIN + "        print('sampling')\n"),
    ("driver", "pad", STAMPED, STAMPED[:-1] + ", data=block.data[::-1])"),
    ("driver", "pad", LEVEL, "            self.n = getattr(self, 'n', 0) + 1\n"
     + LEVEL + "f'<{len(self.stream.channels)}{self.layout}', bytes(size - 3) if self.n < 30 else data[2 : size - 1])"
     "\n            _ = ("),
    ("driver", "pad", "yield self.sample([self.scale * value for value in values])",
     "self.past = [*getattr(self, 'past', []), values][-40:]\n"
     "            yield self.sample([sum(one) / len(self.past) for one in zip(*self.past)])"),
    ("driver", "grip", "1000 * self._time(times)", "self._time(times)"),
    ("driver", "grip", "1000 * self._time(times)", "self._time(times) // 1000"),
    ("driver", "grip", "1000 * self._time(times)", "1067 * self._time(times)"),
    ("driver", "grip", "self._time(times)", "times"),
    ("driver", "grip", "self._number(numbers)", "numbers"),
    ("driver", "grip", "Unwrap(32)", "Unwrap(40)"),
    ("driver", "grip", "        self._left, self._number", "        np.seterr(all='raise')\n        self._left, self._number"),
    # What a transducer reads, and what a spec says.
    ("transducer", "grip", 'apart = np.hypot(grid.x_mm[:, None, None] - places[:, 0], grid.s_mm[None, :, None] -',
     'apart = np.hypot(grid.x_mm[:, None, None] - places[:, 0], grid.s_mm[None, :, None] +'),
    ("transducer", "grip", '"x": state.shear_mpa[0], "y": state.shear_mpa[1]', '"x": state.shear_mpa[1], "y": state.shear_mpa[0]'),
    ("transducer", "grip", '"x": state.shear_mpa[0]', '"x": -state.shear_mpa[0]'),
    ("transducer", "grip", '"y": state.shear_mpa[1]', '"y": -state.shear_mpa[1]'),
    ("transducer", "grip", "found.append(area *", "found.append(area / 9.80665e-3 *"),
    ("transducer", "grip", "found.append(area *", "found.append("),
    ("transducer", "grip", 'young=assumed(0.5, "MPa"', 'young=assumed(0.5, "kPa"'),
    ("transducer", "grip", 'young=assumed(0.5, "MPa"', 'young=assumed(500, "MPa"'),
    ("transducer", "grip", 'thickness=assumed(2, "mm"', 'thickness=assumed(0.02, "mm"'),
    ("transducer", "grip", 'link_delay=assumed(3, "ms"', 'link_delay=assumed(3, "s"'),
    ("transducer", "pad", 'link_delay=assumed(2, "ms"', 'link_delay=assumed(2, "us"'),
    ("transducer", "grip", "normal=(0.0, 0.0, 1.0)", "normal=(0.0, 0.0, -1.0)"),
    ("transducer", "pad", 'white=assumed(1, "count", WHY), step=assumed(1, "count", WHY)', ""),
    ("transducer", "grip", "((-2e-3, -1.1e-3, 0.0), (-2e-3, 1.1e-3, 0.0), (2e-3, -1.1e-3, 0.0), (2e-3, 1.1e-3, 0.0))",
     "((-2e-4, -1.1e-4, 0.0), (-2e-4, 1.1e-4, 0.0), (2e-4, -1.1e-4, 0.0), (2e-4, 1.1e-4, 0.0))"),
    ("transducer", "grip", "lower=-20, upper=20", "lower=-1.5, upper=1.5"),
    ("transducer", "grip", "return np.array(found)", "return np.clip(found, -1.5, 1.5)"),
    # What a task asks.
    ("task", "trial", (SESSION, '"test": (-1.2, -0.2, 0.8, 1.2)'), ('session="bench"', '"test": (-1.5, -0.5, 0.5, 1.5)')),
    ("task", "trial", SESSION, 'session="bench"'),
    ("task", "trial", CAP, 'radius=assumed(8 + mm, "mm", WHY)'),
    ("task", "trial", PRESSED, 'profile=PRESS.model_copy(update={"end": assumed(2.5 + mm, "N", WHY)})'),
    ("task", "trial", (PRESSED, TARGET, LABELS), (
        'profile=PRESS.model_copy(update={"end": assumed(1.0 + (mm > 0), "N", WHY)})',
        'LabelTarget(name="side")', 'labels={"side": int(mm > 0)}')),
    ("task", "trial", LABELS, 'labels={"offset_mm": mm / 1000}'),
    ("task", "trial", MM, 'x=assumed(mm * 10, "mm", WHY)'),
    ("task", "trial", 'end=assumed(2, "N"', 'end=assumed(2, "kN"'),
    ("task", "force", 'metric="rmse", unit="N"', 'metric="rmse", unit="kN"'),
    ("task", "force", ('target=ChannelTarget(),', 'metric="rmse", unit="N"'),
     ('target=ChannelTarget(unit="kN"),', 'metric="rmse", unit="kN"')),
    ("task", "trial", ('"validation": (-1.1, 0.9), ', '("deployable",)'), ("", '("karl2016",)')),
    ("task", "trial", 'features=("taxel",)', 'features=("taxel", "position")'),
    ("task", "trial", LABELS, 'labels={"offset_mm": 1.0}'),
    ("task", "trial", CAP, 'shape="bal"' ' if role == "test" else None'),
    ("task", "trial", 'radius=assumed(8, "mm", WHY)', 'radius=assumed(8, "m", WHY)'),
    # What an estimator answers.
    ("estimator", "estimator", ANSWER, "return np.sort(self.level + (X - self.middle) / self.scale @ self.weights)"),
    ("estimator", "estimator", ANSWER, "return (X - self.middle) / self.scale @ self.weights"),
    ("estimator", "estimator", "self.scale = np.where(spread > 0, spread, 1.0)", "self.scale = 1.0\n        np.random.seed(1)"),
    ("estimator", "estimator", FIT, FIT + "        if len(X) < 64: raise ValueError('too few rows')\n"),
    ("estimator", "estimator", FIT, FIT + "        print('fitting', len(X))\n"),
    ("estimator", "estimator", FIT, FIT + "        y = np.clip(y, -1.0, 1.0)\n"),
    ("estimator", "estimator", ANSWER, "return np.clip(" + ANSWER[7:] + ", -1.0, 1.0)"),
    ("estimator", "estimator", "self.scale = np.where(spread > 0, spread, 1.0)", "self.scale = 1.0; X = X[:, :4]"),
    ("estimator", "estimator", "np.linalg.solve(Z.T @ Z + self.alpha * np.eye(X.shape[1])", "np.linalg.solve(Z.T @ Z + self.alpha * np.eye(4)"),
    ("estimator", "estimator", "return self.level + (X", "self.level += 1e-3; return self.level + (X"),
    ("estimator", "estimator", ANSWER, "return np.round(" + ANSWER[7:] + ")"),
    ("estimator", "estimator", ANSWER, "return self.level + (X - self.middle)[:, :2] / self.scale[:2] @ self.weights[:2]"),
    ("estimator", "estimator", FIT, "        X, y = X[: len(X) // 8], y[: len(X) // 8]\n" + FIT),
    # What an effect does to a recording.
    ("effect", "effect", RIPPLE, "        track.force_n *= 1.1\n" + RIPPLE),
    ("effect", "effect", RIPPLE, "        run.reference_n += 0.1\n" + RIPPLE),
    ("effect", "effect", RIPPLE, "        KEPT.append(1)\n        track.readings += 0.1 * len(KEPT)\n" + RIPPLE),
    ("effect", "effect", RIPPLE, "        if not KEPT: KEPT.append(track.readings.mean())\n        track.readings -= KEPT[0]\n" + RIPPLE),
    ("effect", "effect", RIPPLE, "        track.readings[track.force_n > 0.4] = np.nan\n" + RIPPLE),
    ("effect", "effect", 'produces=("disturbance",)', 'produces=("disturbance",), consumes=("humidity",)'),
    ("effect", "effect", RIPPLE, "        track = __import__('copy').deepcopy(track)\n" + RIPPLE),
    ("effect", "effect", "readings += 0.01", "readings = np.array(0.01)\n        0.01"),
    ("effect", "effect", "track.readings += 0.01", "track.readings += 0.0"),
    ("effect", "effect", RIPPLE, "        track.t_s += 0.5\n" + RIPPLE),
    ("effect", "effect", RIPPLE, "        track.quality[:] = 1\n" + RIPPLE),
    ("effect", "effect", 'Reason(False, "only by name", 0.0)', 'Reason(bool(np.random.rand() > 0.5), "by chance", 0.0)'),
    ("effect", "effect", RIPPLE, "        run.load.force_n[:] = 0.0\n" + RIPPLE),
    # What a shape of an indenter is.
    ("indenter", "shape", HEIGHT, "return (x_mm**2 + y_mm**2) / 40.0"),
    ("indenter", "shape", HEIGHT, "return ((1e-3 * x_mm) ** 2 + (1e-3 * y_mm) ** 2) / (2 * size)"),
    ("indenter", "shape", HEIGHT, "return (x_mm**2 + y_mm**2) / (2e-3 * size)"),
    ("indenter", "shape", HEIGHT, "return (x_mm**2 + y_mm**2) / (2e3 * size)"),
    ("indenter", "shape", HEIGHT, "return 1e3 * (x_mm**2 + y_mm**2) / (2 * 1e3 * size) * 1e3"),
    ("indenter", "shape", HEIGHT, "r = np.hypot(x_mm, y_mm); return np.where(r < size / 2, r**2 / (2 * size), 0.0)"),
    ("indenter", "shape", HEIGHT, "x_mm -= 0.0; x_mm *= x_mm; return (x_mm + y_mm**2) / (2 * size)"),
    ("indenter", "shape", HEIGHT, "rough = np.random.rand(*np.broadcast(x_mm, y_mm).shape); h = (x_mm**2 + y_mm**2)"
     " / (2 * size); return h + 0.1 * rough * (h > 0)"),
    ("indenter", "shape", HEIGHT, "KEPT.append(1); return (x_mm**2 + y_mm**2) / (2 * size * len(KEPT))"),
    ("indenter", "shape", 'default=20.0, unit="mm", least=1.0', 'default=0.02, unit="m"'),
    ("indenter", "shape", HEIGHT, "return (x_mm**2 + y_mm**2) / (2 * size) if size > 15 else np.zeros(1) / 0"),
    ("indenter", "shape", HEIGHT, "return np.floor((x_mm**2 + y_mm**2) / (2 * size))"),
    # What a mapping says of a data set.
    ("dataset", "presses", 'columns: "p1..4"', 'columns: [load, p1, p2, p3, p4]'),
    ("dataset", "presses", "sign: 1", "sign: -1"),
    ("dataset", "presses", "upper: 4095", "upper: 600"),
    ("dataset", "presses", "lower: 0, upper: 4095", "lower: 0, upper: 1048575"),
    ("dataset", "presses", "rate_hz: 50", "rate_hz: 100"),
    ("dataset", "presses", "tasks: [force]", "tasks: [forces]"),
    ("dataset", "presses", ("tasks: [force]", "splits"), ("tasks: [force, contact-location]", "splits")),
    ("dataset", "presses", 'session: "{day}"', 'session: "{day}-{press}"'),
    ("dataset", "presses", "given_in: gf, ", ""),
    ("dataset", "presses", "given_in: gf, ", "given_in: mN, "),
    ("dataset", "presses", "unit: ms, epoch", "unit: s, epoch"),
    ("dataset", "presses", "unit: ms, epoch", "unit: us, epoch"),
    ("dataset", "presses", "sentinels: [-999]", "sentinels: []"),
    ("dataset", "presses", "tuesday: validation, wednesday: test", "tuesday: train, wednesday: train"),
    ("dataset", "presses", "rest: 300", "rest: 3000"),
]  # fmt: skip

SILENT = {
    26: "there are skins of 20 micrometres",
    29: "pads are described with the pressed side up, and down",
    61: "an estimator may look at a share of its rows",
    86: "a body may have steps",
    90: "there are converters of 20 bits that use a thousandth of them",
    96: "0.3 N is as plausible as 3 N",
}
"""Which of them, counted from 1, `check` does not find, and why."""
FOUND_BY = {
    18: "response-is-where-it-is-pressed",
    22: "it-answers-to-a-press",
    24: "skin-yields-as-skins-do",
    41: "scenes-can-be-pressed",
    50: "it-learns",
    62: "it-is-applied",
    88: "readings-are-as-stated",
    92: "tasks-can-be-answered",
}
"""Of some of them the check that finds it: those that find none of the other list."""
TESLA = [('unit="uT", lower=-2048', "lower=-2048"), ('rest=assumed(100, "uT"', 'rest=assumed(100, "count"'),
         ('"uT/MPa"', '"count/MPa"'), ('white=assumed(1, "uT"', 'white=assumed(1, "count"'),
         ('step=assumed(1, "uT"', 'step=assumed(1, "count"')]  # fmt: skip
WIDE = [("A5 07 2C", "A5 07 00 00 00 2C"), ('"<BB{len', '"<BI{len'), ("% 256, *whole", "% 2**32, *whole"), ('}") + 3', '}") + 6'), ("Unwrap(8)", "Unwrap(32)"),
        ("data[1])\n", "int.from_bytes(data[1:5], 'little'))\n"), ("data[2 : size", "data[5 : size")]  # fmt: skip
# Package, and what else a maker may write without a mistake.
SOUND: dict[str, tuple[str, list[tuple[str, str]]]] = {
    "counts, 8 bits": ("pad", []),
    "newton, 16 bits, a clock of its own": ("grip", []),
    "32 bits": ("pad", WIDE),
    "200 Hz": ("pad", [("rate_hz=100.0, dtype", "rate_hz=200.0, dtype"), ("rate_hz, layout, scale = 100.0", "rate_hz, layout, scale = 200.0")]),
    "slow": ("pad", [("rate_hz=100.0, dtype", "rate_hz=2.0, dtype"), ("rate_hz, layout, scale = 100.0", "rate_hz, layout, scale = 2.0")]),
    "noisy": ("pad", [("whole = [round(value / self.scale)", "whole = [round(value / self.scale + self.settings.rng.normal(0, 8 * (len(values) == 4)))"), ('white=assumed(1, "count"', 'white=assumed(8, "count"')]),
    "hysteretic": ("pad", [("Nuisances, SkinSheet", "Creep, Nuisances, SkinSheet"), ('step=assumed(1, "count", WHY)', 'step=assumed(1, "count", WHY), creep=(Creep(fraction=assumed(0.3, "1", WHY), tau=assumed(5, "s", WHY)),)')]),
    "microtesla": ("pad", [(old, new) for new, old in TESLA]),
    "falling": ("pad", [("sign=1", "sign=-1"), ("assumed(400,", "assumed(-400,")]),
    "saturating gently": ("pad", [("100.0 + gain * np.tensordot(stacked, state.pressure_mpa, 2)", "100.0 + 1500 * np.tanh(gain * np.tensordot(stacked, state.pressure_mpa, 2) / 1500)")]),
    "without a driver": ("pad", [('driver="sound_devices.line:Pad", ', ""), ('emulator="sound_devices.line:PadEmulator",', "")]),
    "a stage": ("stage", []),
    "a scale": ("scale", []),
    "no validation": ("trial", [('"validation": (-1.1, 0.9), ', "")]),
    "gentle and firm": ("trial", [("profile=PRESS", 'profile=PRESS.model_copy(update={"end": assumed(1.0 + number % 2, "N", WHY)})'), ('labels={"offset_mm": mm}', 'labels={"firm": number % 2}'), ('LabelTarget(name="offset_mm", unit="mm")', 'LabelTarget(name="firm")'), ('kind="regression"', 'kind="classification"'), ('metric="rmse", unit="mm"', 'metric="macro_f1"'), ('("lasso",)', '("logistic",)'), ('("mean",)', '("majority",)')]),
    "nearest neighbour": ("estimator", [(ANSWER, "return np.array([self.y[np.argmin(((self.X - one) ** 2).sum(axis=1))] for one in X])"), ("        spread =", "        self.X, self.y = X, y\n        spread =")]),
    "missing samples": ("effect", [(RIPPLE, "        track.quality[::50] |= 1\n" + RIPPLE)]),
    "a punch": ("shape", [(HEIGHT, "return np.where(x_mm**2 + y_mm**2 < (size / 4) ** 2, 0.0, 50.0)")]),
}  # fmt: skip


def presses(folder):
    """Write the tables of three days of presses; the load is in gram-force, and one of them has a lost reading."""
    rng, made = np.random.default_rng(3), {}
    for day in ("monday", "tuesday", "wednesday"):
        for press in range(4):
            t_ms = 20 * np.arange(200)
            load = np.interp(t_ms, [0, 500, 3500, 4000], [0, 0, 300 + 20 * press, 0])
            taxels = np.round(300 + np.outer(load, [1.5, 1.2, 0.8, 0.6]) + rng.normal(0, 3, (200, 4)))
            load = np.round(load + rng.normal(0, 1, 200), 2)
            load[150] = -999 if press == 2 else load[150]
            rows = [
                f"{t},{f:g},{','.join(f'{one:.0f}' for one in own)}"
                for t, f, own in zip(t_ms, load, taxels, strict=True)
            ]
            place = ("left", "right")[press % 2]
            made[f"press-{day}-{press}-{place}.csv"] = ("time,load,p1,p2,p3,p4\n" + "\n".join(rows) + "\n").encode()
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in made.items():
        (folder / name).write_bytes(content)
    return {name: hashlib.sha256(content).hexdigest() for name, content in made.items()}


def planted(folder):
    """Write a package for each of them, and the files of the data sets; return their families, kinds and names."""
    digests, found = presses(folder / "files"), []
    for number, (family, package, right, wrong) in enumerate(MISTAKES, 1):
        if family != "dataset":
            written(folder, 1000 + number, package, right, wrong)
            found.append((family, KIND[package], f"planted{1000 + number}-{package}"))
            continue
        text = (SHELF / "sound_trial" / "datasets" / "sound-presses.yaml").read_text()
        for one, other in zip(*(((right,), (wrong,)) if isinstance(right, str) else (right, wrong)), strict=True):
            text = text.replace(one, other)
        path = folder / f"planted{1000 + number}.yaml"
        path.write_text(text.replace("{FILES: " + "0" * 64 + "}", str(digests).replace("'", '"')))
        found.append((family, "dataset", str(path)))
    return found


def said_of(registry, folder, planted, number):
    """Return what `check` says of one, counted from 1: empty where it is silent."""
    from tactbench.core.conformance.run import plugins_named, run_checks, subjects_named
    from tactbench.core.errors import TactbenchError

    _, kind, subject = planted[number - 1]
    said = [row.reason for row in plugins_named(registry, f"planted-{1000 + number}") if row.status == "failed"]
    try:
        if not said:
            (one,) = subjects_named(registry, subject, (kind,))
            with np.errstate(), contextlib.redirect_stdout(io.StringIO()):
                report = run_checks(one, isolated=False, root=folder / "files", without=("import-is-light",))
            said = [f"{o.check}: {o.where}: {o.text}" for o in report.failed]
    except TactbenchError as error:
        said = [str(error)]
    return "; ".join(said)


def outcomes(families=()):
    """Yield the number, the family and what `check` says of each, or of some families."""
    from tactbench.core.plugins.registry import load_registry

    with tempfile.TemporaryDirectory() as name:
        every = planted(Path(name))
        sys.path[:0] = [name, str(SHELF)]
        registry = load_registry()
        for number, (family, *_) in enumerate(every, 1):
            if not families or family in families:
                yield number, family, said_of(registry, Path(name), every, number)


if __name__ == "__main__":
    os.environ.setdefault("CI", "1")
    counts: dict[str, list[int]] = {}
    for number, family, said in outcomes(sys.argv[1:]):
        counts.setdefault(family, []).append(bool(said))
        print(
            f"{number:3} {family:10} {'caught' if said else 'SILENT'}  {said[:230] or MISTAKES[number - 1][3]}",
            flush=True,
        )
    for family, caught in counts.items():
        print(f"{family}: {sum(caught)} of {len(caught)}")
