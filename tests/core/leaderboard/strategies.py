"""Rows with names that formats must escape, odd numbers, every status."""

from hypothesis import strategies as st

from tactbench.core.spec.row import STATUSES

from .rows import row

HOSTILE = (
    "\x1b[31mred\x1b[0m", "a|b\\|c", "[link](x)", "<b>&lt;</b>", "=1+1", "**bold** _a_ `code` ~~x~~",
    "$x$ #1 %c ^2 & ~ {}", "line\nbreak\u2028", "\ud800", "é 中 😀", "# heading #", "1. one", "", '"a", b;c\td',
)  # fmt: skip

texts = st.one_of(
    st.sampled_from(HOSTILE), st.text(st.characters(exclude_categories=()), max_size=12), st.sampled_from("ab")
)
numbers = st.floats(-1e6, 1e6)
times = st.one_of(st.none(), st.floats(0, 1e5))


@st.composite
def some_rows(draw, most=4):
    """Rows with names of their own."""
    return [draw(one_row(place)) for place in range(draw(st.integers(1, most)))]


@st.composite
def one_row(draw, place):
    status = draw(st.sampled_from(["done"] * 4 + [status for status in STATUSES if status != "done"]))
    done = status == "done"
    metric, unit = draw(st.sampled_from([("rmse", "N"), ("macro_f1", "1"), ("accuracy", "1"), ("r2", "1")]))
    some = {"rmse": st.floats(0, 1e6), "r2": st.floats(-1e6, 1)}.get(metric, st.floats(0, 1))
    low, score, high = sorted(draw(st.tuples(some, some, some)))
    more = {
        "cell": f"{place} {draw(texts)}",
        "task": metric,
        "metric": metric,
        "unit": unit,
        "params": draw(st.dictionaries(texts, texts, max_size=2)),
        "status": status,
        "reason": "" if done else draw(texts),
        "split": draw(st.sampled_from(["session", "roles"])) if done else draw(st.sampled_from(["session", None])),
        "protocol": draw(st.sampled_from(["deployable", "karl2016"])),
        "rig": draw(st.sampled_from(["twin", "arm"])),
        "is_baseline": draw(st.booleans()),
        "simulated": done and draw(st.booleans()),
        "dagger": draw(st.booleans()),
        "stamps": draw(st.lists(texts, max_size=1)),
        "score": score if done else None,
        "ci_low": low if done else None,
        "ci_high": high if done else None,
        "published": draw(st.one_of(st.none(), numbers)),
        **{key: draw(times) for key in ("sim_s", "fit_s", "latency_ms_p50")},
    }
    return row(draw(texts), draw(texts), **more)
