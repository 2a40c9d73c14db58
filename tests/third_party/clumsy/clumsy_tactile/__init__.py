"""Estimators that do what they should not: each of them must cost its own row only."""

from tactbench.plugin import EstimatorDescriptor, hookimpl

TACTBENCH_API = 2
KINDS = ("regression", "classification")


@hookimpl
def tactbench_estimators():
    return [
        EstimatorDescriptor(name=name, title=title, kinds=KINDS, where=f"clumsy_tactile.answers:{name}")
        for name, title in (
            ("breaks", "Breaks when it is taught"),
            ("tires", "Breaks when it is taught for the third time"),
            ("lacks", "Lacks something"),
        )
    ]
