"""Estimators and rigs with mistakes that a tired engineer makes: each of them may cost its own rows only."""

from tactbench.plugin import EstimatorDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 2
KINDS = ("regression", "classification")
ESTIMATORS = {
    "evil-raise": "answers:evil_raise",
    "evil-abort": "answers:evil_abort",
    "evil-eat": "answers:evil_eat",
    "evil-latin": "answers:evil_latin",
    "evil-import": "aborting:build",
    "evil-patch": "patch:build",
}


@hookimpl
def tactbench_estimators():
    return [
        EstimatorDescriptor(name=name, title=name, kinds=KINDS, where=f"evil_tactile.{where}")
        for name, where in ESTIMATORS.items()
    ]


@hookimpl
def tactbench_rigs():
    return [
        RigDescriptor(name=f"evil-{name}", title=title, where=f"evil_tactile.rigs:{name}", simulated=simulated)
        for name, title, simulated in (
            ("unbuilt", "Raises when it is built", True),
            ("dying", "Aborts in the second scene", True),
            ("device", "A device that hangs in the second scene and must be let go of", False),
        )
    ]
