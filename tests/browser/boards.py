"""Rows of a board that has everything: two directions, two hosts, stopped cells, hostile names, many lines."""

import hashlib
import json

from tests.core.leaderboard.rows import row

HOSTILE = (
    "<script>window.stranger = 1</script>", "</script><b>", "<!--", "\"'><img src=x onerror='window.stranger = 1'>",
    "a\u202egpj", "b\x1b[31m", "\ud800", "c\u2028d", "{the data}", "$script `rm`",
)  # fmt: skip
HOST, OTHER = "0123456789ab", "ba9876543210"
TRACEBACK = "Traceback (most recent call last):\n  File <b>x</b>\nValueError: <i>no</i>"


def board_rows():
    rows = []
    for n in range(24):
        slow = n * 7 % 24  # the slower, the better, more or less
        about = {"fit_s": 10.0 ** (slow / 4 - 3), "latency_ms_p50": 10.0 ** ((slow + n % 3) / 8 - 2),
                 "n_sessions": n % 5, "host": OTHER if n % 6 == 5 else HOST, "concurrency": 1 + n % 2,
                 "made_by": MADE_BY}  # fmt: skip
        good = slow - 5 * (n % 4) + n / 1e4
        rows.append(row(f"s{n:02d}", score=0.6 - good / 100, key=f"{n:064x}", **about))
        share = 0.5 + good / 60
        rows.append(row(f"s{n:02d}", task="kind", cell=f"s{n:02d}/kind", metric="macro_f1", unit="1", score=share,
                        ci_low=share - 0.1, ci_high=share + 0.01, baseline=0.2, classes=["soft", "hard"],
                        confusion=[[5, 1], [0, 7]], scores={"fold 1": 0.5, "fold 2": 0.625}, **about))  # fmt: skip
    rows.append(row("s00", "mean", score=1.4, host=HOST))
    rows.append(row("s01", status="crashed", score=None, ci_low=None, ci_high=None, reason="signal 11", signal=11,
                    traceback=TRACEBACK, log="printed \x1b[1mthis\nand that", cell="s01/crashed"))  # fmt: skip
    rows.append(row("s02", status="skipped", score=None, ci_low=None, ci_high=None, reason="needs a vibration stream"))
    plan = [{"effect": "creep", "included": True, "reason": "it lasts"},
            {"effect": "noise", "included": False, "reason": "nobody hears it"}]  # fmt: skip
    rows.append(row("real", simulated=False, rig="arm", host=HOST, plan=plan, assumptions={"drift": "0.1 %"}))
    rows += [row(name, cell=f"{name}/{n}", reason=name, remarks=[name], host=HOST) for n, name in enumerate(HOSTILE)]
    return rows


PROVENANCE = [
    {"host": HOST, "python": "3.12.0", "cpu": "another run"},
    {"host": HOST, "python": "3.11.7", "cpu": "<u>cpu</u>", "distributions": {"numpy": "2.0"}},
]
MADE_BY = hashlib.sha256(json.dumps(PROVENANCE[1], sort_keys=True).encode()).hexdigest()[:16]
