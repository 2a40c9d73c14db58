"""Estimators with one flaw each."""

from tactbench.plugin import EstimatorDescriptor, hookimpl

TACTBENCH_API = 2
FLAWS = {
    "of-no-kind": {"kinds": ()},
    "without-its-argument": {"params": {"alpha": 1.0, "beta": 2.0}},
    "with-a-candidate-twice": {"grid": {"alpha": (0.1, 0.1)}},
    "with-an-impossible-candidate": {"grid": {"alpha": (1.0, -1.0)}},
    "linear-by-name": {"linear": True},
    "of-a-package-unknown": {"distributions": ("no-such-distribution",)},
}
CODES = (
    "that-cannot-predict", "with-columns", "of-nan", "that-scales-in-place", "deaf-to-the-seed", "that-looks-around",
    "that-remembers", "that-turns-the-sign", "afraid-of-constants", "that-skips", "that-would-skip-tests",
)  # fmt: skip


@hookimpl
def tactbench_estimators():
    def estimator(name, code="sound", **changes):
        where = f"flawed_tactile.answers:{code.replace('-', '_')}"
        plain = {"title": "Ridge", "kinds": ("regression",), "params": {"alpha": 1.0}}
        return EstimatorDescriptor(**{"name": name, "where": where, **plain, **changes})

    linear = {"linear-by-name": "curved"}
    return [
        estimator("sound-estimator"),
        *(estimator(f"estimator-{name}", linear.get(name, "sound"), **changes) for name, changes in FLAWS.items()),
        *(estimator(f"estimator-{code}", code) for code in CODES),
    ]
