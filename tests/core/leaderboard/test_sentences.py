"""What is said above and below a table is true of its rows; docs/tables.md has the list."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.paired import difference
from tactbench.core.statistics.ranking import ranks as ranked
from tactbench.core.statistics.replicates import over_replicates

from .rows import row

RECORDED = {"simulated": False, "rig": "replay"}


ESTIMATORS = (["ols"], ["ols", "lasso"], ["ols", "time", "mean"], ["ols", "lasso", "forest", "time", "mean"])


@st.composite
def boards(draw):
    """Cells of one question as a result folder holds them: of simulated campaigns, or of recorded sessions."""
    pick = lambda *choices: draw(st.sampled_from(choices))  # noqa: E731
    simulated = pick(True, False)
    error = pick(True, False) or not simulated
    floor, true = (pick(None, 0.1), pick(True, False)) if error and simulated else (None, False)
    repeats, dagger = draw(st.integers(1, 9)), pick(True, False)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    common = 0.1 * rng.standard_normal(repeats)
    kind = {} if error else {"metric": "macro_f1", "unit": "1", "classes": [0, 1]}
    kind |= {"dagger": dagger} if simulated else {"dagger": dagger, **RECORDED}
    unit, rows = pick("session", "recording", "press"), []
    for sensor in pick("a", "ab", "abc"):
        for estimator in pick(*ESTIMATORS):
            spread = rng.choice([0.0, 0.01, 0.3])
            each = np.clip(rng.choice([0.3, 0.5, 0.8]) + common + spread * rng.standard_normal(repeats), 0.01, 0.99)
            more = kind | {
                "looks_at": {"time": "time", "mean": "nothing"}.get(estimator, "features"),
                "is_baseline": estimator in ("time", "mean"), "published": pick(None, None, 0.2, 0.5),
                "stamps": pick([], [], ["It leaks."]), "findings": pick([], [], ["ms read as s?"]),
                "answer_delay_ms": pick(None, 20.0), "host": pick("h", "h", "i"),
            }  # fmt: skip
            if not simulated:
                squares, begins = each.round(6) ** 2, pick(0, 0, 3)
                score = float(np.sqrt(squares.mean()))
                more["replicates"] = {
                    "unit": unit, "names": list(map(str, range(begins, begins + repeats))), "strata": None,
                    "sums": [[10.0 * one, 10.0] for one in squares], "own": np.sqrt(squares).tolist(),
                }  # fmt: skip
                more |= {"ci_low": None, "ci_high": None, "n_specimens": pick(None, 1, 1, 2)}
                if repeats >= 5:
                    more |= {"ci_low": score - 0.1, "ci_high": pick(score + 0.1, None)}
                rows.append(row(sensor, estimator, score, **more))
                continue
            for seed, one in enumerate(map(float, each), 1):
                known = {"true_score": 0.9 - one / 2} if true else {}
                if floor:
                    beyond = max(0.0, one**2 - floor**2) ** 0.5
                    known |= {"reference_floor": floor, "reference_floor_se": 0.01, "score_beyond_floor": beyond}
                cell = f"{sensor}/question/twin/deployable/{estimator}/{seed}"
                rows.append(row(sensor, estimator, one, seed=seed, cell=cell, **known, **more))
    for place in range(pick(0, 0, 1, 6)):
        alike = {key: rows[0][key] for key in ("metric", "unit", "dagger", "split", "simulated", "rig")}
        ended = {"status": pick("failed", "skipped"), "reason": pick("No.", "None.")}
        rows.append(row("a", f"x{place}", None, fit_s=None, **alike, **ended))
    return over_replicates(rows)


class Truth:
    """A board by the rows alone, and the facts that sentences state."""

    def __init__(self, rows):
        # Of equal trivial answers the first.
        self.rows = sorted((one for one in rows if one["status"] == "done"), key=lambda one: one["cell"])
        self.stopped = [one for one in rows if one["status"] != "done"]
        rows = self.rows
        self.true = rows[0]["metric"] == "true_rmse"
        self.sign = 1.0 if self.true or rows[0]["metric"] == "rmse" else -1.0
        self.answers = [one for one in rows if not one["is_baseline"]]
        self.better = [one for one in self.answers if not self.reaches(one, one["score"])]
        self.worse = [one for one in self.answers if one not in self.better]
        known = [one for one in self.better if one["ci_low"] is not None]
        self.unshown = [one for one in known if self.reaches(one, self.worse_end(one))]
        if rows[0]["replicate_unit"] != "replicate":  # pairs of units tell, where they are the same
            pairs = [(one, self.bar(one)) for one in known]
            same = [one for one, bar in pairs if bar and one["replicates"]["names"] == bar["replicates"].get("names")]
            self.unshown = [one for one in self.unshown if one not in same]
            self.unshown += [one for one in same if not self.clear(one)]
        self.several = len({one["sensor"] for one in rows}) > 1
        self.floor = all(one.get("score_beyond_floor") is not None for one in self.better)
        enough = self.better and all(one["n_replicates"] >= 5 for one in self.better)
        self.ranks = ranked(self.better) if enough else None

    def clear(self, one):
        found = difference(one, self.bar(one))
        return self.sign * (found.high if self.sign > 0 else found.low) < 0

    def shared(self):
        return len({tuple(one["replicates"]["names"]) for one in self.better}) == 1

    def targets_differ(self):
        scores = [bar["score"] for one in self.better if (bar := self.bar(one))]
        return bool(scores) and max(scores) > 1.05 * min(scores)

    def worse_end(self, one):
        end = one["ci_high" if self.sign > 0 else "ci_low"]
        return np.inf if end is None else end

    def bar(self, one):
        """The best trivial answer of the same sensor."""
        own = [other for other in self.rows if other["is_baseline"] and other["sensor"] == one["sensor"]]
        return min(own, key=lambda other: self.sign * other["score"], default=None)

    def reaches(self, one, value):
        bar = self.bar(one)
        return bar is not None and value is not None and self.sign * value >= self.sign * bar["score"]

    def name(self, one):
        return f"{one['sensor']}/{one['estimator']}" if self.several else one["estimator"]

    def called(self, text):
        (found,) = [one for one in self.rows if self.name(one) == text]
        return found

    def order(self, one):
        kept = one["replicates"]
        return float(np.median(kept["excess"])) if self.floor and kept else self.sign * one["score"]

    def leads(self, name):
        mine = self.order(self.called(name))
        return all(mine <= self.order(other) + 1e-12 for other in self.better)

    def bars(self, text, rows):
        """Whether a list in brackets has the scores of the trivial answers of these rows."""
        expected = {f"{self.bar(one)['score']:.{3 if self.sign < 0 else 4}f}" for one in rows}
        return set(re.findall(r"-?\d+\.\d+", text)) == expected

    def ahead(self, name, other):
        first, second = self.called(name), self.called(other)
        behind = [one for one in self.better if one is not first]
        assert self.gap(first, second) <= min(self.gap(first, one) for one in behind) + 1e-12
        return all(self.ranks[one["cell"]].behind for one in behind)

    def near(self, name):
        rank = self.ranks[self.called(name)["cell"]]
        return rank.place == 1 or not rank.behind

    def gap(self, first, second):
        """By how much an answer is worse: the mean of the campaigns' differences, else the difference of scores."""
        kept = [one["replicates"] or {} for one in (first, second)]
        key = next((key for key in ("beyond", "scores") if all(key in one for one in kept)), None)
        one, other = [one[key] for one in kept] if key else (first["score"], second["score"])
        return self.sign * (np.mean(other) - np.mean(one))

    def worse_by(self, name, other, value, low, high):
        gap = self.gap(self.called(name), self.called(other))
        return 0 <= low <= value <= high and value == pytest.approx(gap, abs=6e-4)  # it has three decimals

    def stamped(self, names, more, key="stamps"):
        """Whether these rows, and so many more, are stamped; without names all."""
        stamped = [self.name(one) for one in self.rows if one[key]]
        named = names.split(", ") if names else stamped
        return set(stamped).issuperset(named) and len(stamped) == len(named) + int(more or 0)

    def ended(self, status, others, reason):
        family = [one for one in self.stopped if one["status"] == status]
        return len([one for one in family if one["reason"] != reason]) == others < len(family)

    def counts(self, text, rows):
        numbers = [int(one) for one in re.findall(r"\d+", text)]
        return (min(numbers), max(numbers)) == tuple(f(one["n_replicates"] for one in rows) for f in (min, max))


NAME = r"(?:In simulation )?(\S+)"
QUALITY = "(?:the best score|the smallest error beyond the floor)"
ABOVE = {
    rf"{NAME} is best; closest is (\S+?)(?:, worse by ([\d.]+)(?: N)? \(95 % ([\d.]+) … ([\d.]+)\))?\.":
        lambda t, a, b, *by: t.ahead(a, b) and t.leads(a) and (by[0] is None or t.worse_by(a, b, *map(float, by))),
    rf"{NAME} has {QUALITY}; (.*?)(?: and \d+ more)? cannot be distinguished from it\.":
        lambda t, a, b: t.leads(a) and all(t.near(one) for one in b.split(", ")),
    rf"{NAME} has {QUALITY}, and is not shown to be better than the trivial answer of its own sensor \((\S+) .*\)\.":
        lambda t, a, b: t.leads(a) and t.called(a) in t.unshown and t.name(t.bar(t.called(a))) == b,
    rf"{NAME} alone is better than the trivial answer of its own sensor\.":
        lambda t, a: t.better == [t.called(a)],
    r"(.*(?:campaign|session|recording|press)(?:e?s)?): too few .* need 5(?: \(`--repeats 8`\))?; (\S+) has .*\.":
        lambda t, n, a: t.counts(n, t.better) and min(o["n_replicates"] for o in t.better) < 5 and t.leads(a),
    r"No answer is better than .* of its own sensor \((.*)\)\.":
        lambda t, b: not t.better and t.bars(b, t.answers),
    r"time reads no sensor, only the time: such a score needs no touch\.":
        lambda t: any(t.bar(o)["looks_at"] == "time" for o in [*t.worse, *t.unshown]),
}  # fmt: skip
BELOW = {
    r"‡  (?:(.*?)(?: and (\d+) more)?: )?It leaks": lambda t, a, more: t.stamped(a, more),
    r"!  (?:(.*?)(?: and (\d+) more)?: )?ms read as s\?": lambda t, a, more: t.stamped(a, more, "findings"),
    "=  each .*": lambda t: any(rank.low < rank.high for rank in t.ranks.values()),
    r"–  no better .*\((.*)\)": lambda t, b: t.bars(b, t.worse),
    r"\*  not shown .*\((.*)\)": lambda t, b: t.bars(b, t.unshown),
    r"Protocol deployable .*": lambda t: any(one["dagger"] for one in t.rows),
    # 1.96 × 0.01 either side.
    r"Beyond floor: [^;.]*(; places go by it)?\. Floor: .* \((?:[abc] 0\.1000 ± 0\.0196(?:, )?)+\)\.":
        lambda t, by: bool(by) == (bool(t.better) and t.floor) and not t.true,
    r"True RMSE: .*": lambda t: t.true,
    r"Score: median over (.*? campaigns?), .* seed(; interval: .* at least [\d.]+ %)?\.":
        lambda t, n, i: t.counts(n, t.answers) and bool(i) == any(o["ci_low"] is not None for o in t.answers),
    r"Places: (paired|unpaired)[^;]*?(; the targets differ [^)]*\))?(; one specimen of each sensor: .*)?\.":
        lambda t, pairs, targets, one: (pairs == "paired") == t.shared() and bool(targets) == t.targets_differ()
        and bool(one) == ({o["n_specimens"] for o in t.better} == {1}),
    r"Times cannot be compared: they were taken on 2 hosts\.": lambda t: len({o["host"] for o in t.answers}) == 2,
    r"a/x.*?(?: and \d+ more)? (failed|skipped)(?:; (\d+) more ended otherwise)?: (\w+\.)":
        lambda t, status, others, reason: t.ended(status, int(others or 0), reason),
}  # fmt: skip


def holds(text, known, truth):
    """Whether a sentence is on the list and true."""
    for pattern, says in known.items():
        if found := re.fullmatch(pattern, text):
            return bool(says(truth, *found.groups()))
    return False


@settings(max_examples=200, deadline=None)
@given(boards())
def test_what_is_said_is_on_the_list_short_and_true(rows):
    (block,) = build_table(rows).blocks
    truth = Truth(rows)
    assert len(block.verdict) <= 2
    assert block.verdict or (len(truth.better) == 1 and truth.bar(truth.better[0]) is None)
    assert len(block.notes) <= 5
    for text in block.verdict:
        assert holds(text, ABOVE, truth), text
    for note in block.notes:
        assert holds(note, BELOW, truth), note
    for line in block.lines:
        if line.kind == "result":
            marks = [mark for mark in "‡*!" if mark in line.texts["notes"]]
            marks += ["="] * (line.texts["place"].endswith("=") and truth.ranks is not None)
            marks += ["–"] * bool(line.texts["place"] == "–" and truth.better)
            explained = {note[0] for note in block.notes}
            assert explained.issuperset(marks), (marks, explained)
            assert ("!" in marks) == bool(line.row["findings"])
            assert (line.texts["place"] == "–") == (line.row not in truth.better)
            assert ("*" in line.texts["notes"]) == (line.row in truth.unshown)
