"""Hard recordings for every protocol and every installed estimator, each made by hand and evaluated from its file.

The right answer of all of them: a finite score within its interval, or an error that says what was given, what was
expected and the next step. Never NaN, never a hang, never a warning.
"""

import itertools
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.evaluation.protocols import PROTOCOLS
from tactbench.core.plugins.registry import installed
from tactbench.plugin import Block, ChannelSpec, EstimatorDescriptor, Quality, StreamSpec
from tests.core.evaluation.made import FORCE, evaluated, force_task, label_task, sensor_of, write
from tests.hard.cases import Case, Family

QUICK: dict[str, dict[str, Any]] = {name: {"n_estimators": 5} for name in ("forest", "extra-trees")}
"""Parameters that make an estimator quick, and leave it the same code."""
ROLES = ("train", "validation", "test")


@dataclass
class Made:
    """One recording in the making."""

    X: np.ndarray
    force: np.ndarray
    label: str
    role: str | None
    session: str
    quality: np.ndarray
    t_ns: np.ndarray | None
    force_t_ns: np.ndarray | None = None
    dtype: str = "float64"
    dropped: int = 0
    """Rows in which some taxel has no sample."""
    annotated: np.ndarray | None = None
    """(n,) labels of rows instead of one for the recording."""

    def keep(self, rows):
        """Leave the first rows; how many of those have a dropout is for the package to say."""
        for name in ("X", "force", "quality", "t_ns", "force_t_ns", "annotated"):
            values = getattr(self, name)
            setattr(self, name, None if values is None else values[:rows])
        self.dropped = 0


def families():
    """Return one family for each protocol and kind of estimator, of each kind of task that it can do."""
    found: dict[str, Family] = {}
    for protocol, one in itertools.product(PROTOCOLS, different_estimators()):
        for kind in one.kinds:
            found[f"evaluation: {protocol} x {one.name} ({kind})"] = partial(
                any_data, protocol=protocol, name=one.name, kind=kind
            )
    return found


def different_estimators():
    """Return the installed estimators, one of each code: ten trees and five hundred are the same code.

    Detectors of events answer no question of single samples: tests/core/evaluation/test_events.py has them.
    """
    first: dict[tuple[str, str], EstimatorDescriptor] = {}
    for one in installed().estimators:
        if one.kinds == ("events",):
            continue
        try:
            for name in one.distributions:
                version(name)
        except PackageNotFoundError:
            continue  # an extra that is not installed answers nothing
        first.setdefault((one.where, one.looks_at), one)
    return list(first.values())


def any_data(case, *, protocol, name, kind):
    """Score hard data finitely, or say what is wrong with it."""
    recordings = _ordinary(case, kind, roles_only=PROTOCOLS[protocol].roles_only)
    hardships = [one for one in HARDSHIPS if case.chance(0.15)] or [HARDSHIPS[case.rng.integers(len(HARDSHIPS))]]
    case.says(hardships=", ".join(one.__name__ for one in hardships))
    for one in hardships:
        one(case, recordings)
    # A probe refuses what changes within a recording, as a force does.
    answerable = kind == "regression" and HARMLESS.issuperset(hardships) and not PROTOCOLS[protocol].first_row_only
    case.right = "answer" if answerable else "either"
    asked = {"regression": force_task, "classification": label_task}[kind](
        protocols=tuple(PROTOCOLS), splits=("roles", "session", "in-session", "shuffled"), baselines=("mean",)
    )
    with tempfile.TemporaryDirectory() as folder:
        paths = [_written(made, Path(folder) / f"r{place}.h5") for place, made in enumerate(recordings)]
        splits = [None] if PROTOCOLS[protocol].roles_only else [None, "in-session", "shuffled"]
        split = splits[case.rng.integers(len(splits))]
        case.says(split=str(split))
        result = evaluated(asked, paths, name, protocol, split, params=QUICK.get(name), latency=True)
    low, high = result.ci_low, result.ci_high
    case.holds(np.isfinite(result.score), f"the score is {result.score}")
    case.holds(low is None or high is None or low <= result.score <= high, f"the interval runs from {low} to {high}")
    case.holds(np.isfinite(list(result.scores.values())).all(), f"a score is none: {result.scores}")
    warned = [text for text in result.counts if "RuntimeWarning" in text]
    case.holds(not warned, f"{warned}")
    dropped = sum(made.dropped for made in recordings)
    told = sum(count for text, count in result.counts.items() if text.startswith("rows left out because"))
    case.holds(told >= dropped, f"{dropped} rows have a dropout, {told} are counted")
    if kind == "classification":
        case.holds(0 <= result.score <= 1, f"a score of {result.score}")


def _ordinary(case, kind, *, roles_only):
    """Return recordings of a press: roles and more than 600 rows where the protocol wants them."""
    taxels = int(case.rng.integers(1, 6))
    gain = case.rng.normal(0, 30, taxels)
    places = list(range(int(case.rng.integers(3 if roles_only else 1, 7))))
    case.says(recordings=len(places), taxels=taxels)
    made = []
    for place in places:
        n = int(case.rng.integers(620, 760)) if roles_only else int(case.rng.integers(150, 300))
        force = np.linspace(0.0, 5.0, n)
        X = 1000.0 + force[:, None] * gain + case.rng.normal(0, 1, (n, taxels))
        role = ROLES[place % 3] if roles_only or len(places) > 3 else None
        label = f"class {place // 3 % 2 if roles_only else place % 2}"
        if kind == "classification":
            X += 5.0 * int(label[-1])
        t_ns = np.arange(n, dtype=np.int64) * 10_000_000
        made.append(Made(X, force, label, role, f"s{place // 2}", np.zeros(X.shape, np.uint8), t_ns))
    return made


def _some(case, recordings):
    """Return one recording, those of one role, or all of them."""
    which = case.rng.integers(3)
    if which == 0:
        return [recordings[case.rng.integers(len(recordings))]]
    role = recordings[case.rng.integers(len(recordings))].role
    return [made for made in recordings if which == 2 or made.role == role]


def _taxel(case, made):
    return int(case.rng.integers(made.X.shape[1]))


def constant_taxels(case, recordings):
    """Hold a taxel, or all of them, at one number; 0.1 a million times has a rounding error for a deviation."""
    column = slice(None) if case.chance(0.3) else _taxel(case, recordings[0])
    for made in _some(case, recordings):
        made.X[:, column] = float(case.rng.choice([0.0, 0.1, 4095.0, -1e8]))


def collinear_taxels(case, recordings):
    """Make a taxel the copy, or a multiple, of another."""
    a, b, factor = _taxel(case, recordings[0]), _taxel(case, recordings[0]), float(case.rng.choice([1.0, -1.0, 1e6]))
    for made in recordings:
        made.X[:, b] = factor * made.X[:, a]


def saturated_taxels(case, recordings):
    """Clip at a converter's end and flag it."""
    for made in _some(case, recordings):
        end = np.quantile(made.X, case.uniform(0, 1))
        made.quality |= np.where(end <= made.X, np.uint8(Quality.SATURATED), np.uint8(0))
        np.minimum(made.X, end, out=made.X)


def dropouts(case, recordings):
    """Lose samples: NaN, infinity, or a number marked as missing; one row, some, nearly all, or a whole channel."""
    for made in _some(case, recordings):
        share = float(case.rng.choice([0.0, 0.05, 0.5, 0.99, 1.0], p=[0.3, 0.3, 0.2, 0.1, 0.1]))
        column = _taxel(case, made)
        lost = case.rng.random(len(made.X)) < share
        lost[case.rng.integers(len(lost))] = True
        if case.chance(0.3):
            made.quality[lost, column] |= np.uint8(Quality.MISSING)
        else:
            made.X[lost, column] = float(case.rng.choice([np.nan, np.inf, -np.inf]))
        made.dropped = max(made.dropped, int(lost.sum()))


def dropouts_of_force(case, recordings):
    """Lose samples of the reference force."""
    for made in _some(case, recordings):
        made.force[case.rng.random(len(made.force)) < case.rng.choice([0.05, 0.9, 1.0])] = np.nan


def huge_offsets(case, recordings):
    """Put a unit signal on 1e8."""
    for made in recordings:
        made.X += case.rng.choice([1e8, -1e8, 1e10])


def extreme_sizes(case, recordings):
    """Read in units from 1e-150 to 1e100."""
    factor = case.decades(1e-150, 1e100)
    column = slice(None) if case.chance(0.5) else _taxel(case, recordings[0])
    for made in recordings:
        made.X[:, column] *= factor


def single_precision(case, recordings):
    """Store as float32, perhaps on an offset of 1e4."""
    offset = float(case.rng.choice([0.0, 1e4, 1e7]))
    for made in recordings:
        made.X = np.where(np.isfinite(made.X), np.clip(made.X + offset, -1e38, 1e38), made.X)
        made.dtype = "float32"


def constant_labels(case, recordings):
    """Hold force and label still."""
    for made in _some(case, recordings):
        made.force[:] = float(case.rng.choice([0.0, 0.1, 5.0]))
        made.label = "class 0"


def jumping_labels(case, recordings):
    """Label single rows, some of them not at all."""
    for made in _some(case, recordings):
        made.annotated = case.rng.choice(np.array(["", "class 0", "class 1", "class 2"]), len(made.X))


def few_rows(case, recordings):
    """Leave one to ten rows, fewer than any window; under the paper's protocol one to ten after its first 600."""
    rows = int(case.rng.integers(1, 11))
    for made in _some(case, recordings):
        made.keep(rows + (600 if len(made.X) > 600 and case.chance(0.8) else 0))


def every_row_an_outlier(case, recordings):
    """Let every row leave the three-sigma band in one channel of its own: none is left."""
    n = 12
    taxels = max(n, max(made.X.shape[1] for made in recordings))
    hit = _some(case, recordings)
    for made in recordings:
        more = ((0, 0), (0, taxels - made.X.shape[1]))
        made.X, made.quality = np.pad(made.X, more, constant_values=1.0), np.pad(made.quality, more)
    for made in hit:
        made.keep((600 if len(made.X) > 600 else 0) + n)
        last = min(n, len(made.X))
        made.X[-last:] = 1.0
        made.X[-last:][np.arange(last), np.arange(last)] = 1e6


def strange_clocks(case, recordings):
    """Repeat time stamps, let them run backwards, shift the force's against the taxels', or leave the clock out."""
    which = int(case.rng.integers(5))
    for made in _some(case, recordings):
        n = len(made.X)
        if made.t_ns is None:
            continue
        if which == 0:
            made.t_ns = np.repeat(made.t_ns[::3], 3)[:n]
        elif which == 1:
            made.t_ns = made.t_ns[::-1].copy()
        elif which == 2:
            made.t_ns = np.zeros(n, dtype=np.int64)
        elif which == 3:
            made.force_t_ns = made.t_ns + int(case.decades(1e3, 1e12))
        else:
            made.t_ns = made.force_t_ns = None


def one_kind_of_session(case, recordings):
    """Give each session one class only, or all recordings one session."""
    one = case.chance(0.5)
    for made in recordings:
        made.session = "s" if one else made.label


Hardship = Callable[[Case, list[Made]], None]
HARDSHIPS: tuple[Hardship, ...] = (
    constant_taxels, collinear_taxels, saturated_taxels, dropouts, dropouts_of_force, huge_offsets, extreme_sizes,
    single_precision, constant_labels, jumping_labels, few_rows, every_row_an_outlier, strange_clocks,
    one_kind_of_session,
)  # fmt: skip
HARMLESS = frozenset(
    (constant_taxels, collinear_taxels, saturated_taxels, huge_offsets, single_precision, one_kind_of_session)
)
"""What no regression may refuse: nothing that is asked for is missing."""


def _written(made, path):
    channels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(made.X.shape[1]))
    times = made.t_ns if made.force_t_ns is None else made.force_t_ns
    return write(
        path, sensor_of(StreamSpec(name="taxels", channels=channels, dtype=made.dtype)),
        Block("taxels", made.t_ns, made.X.astype(made.dtype), made.quality),
        Block("force_torque", times, made.force[:, None]),
        annotations={} if made.annotated is None else {"kind": made.annotated}, reference=(FORCE,),
        clock="none" if made.t_ns is None else "device", role=made.role, session=made.session,
        labels={"kind": made.label} if made.annotated is None else {},
    )  # fmt: skip
