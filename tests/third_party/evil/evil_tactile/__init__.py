"""Estimators and rigs with mistakes that a tired engineer makes: each of them may cost its own rows only."""

from tactbench.plugin import EstimatorDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 2
KINDS = ("regression", "classification")
ESTIMATORS = {
    "evil-raise": "Raises",
    "evil-abort": "Aborts, as in a segmentation fault",
    "evil-hang": "Never comes back",
    "evil-eat": "Takes memory without end",
    "evil-built-elsewhere": "Changes the working folder when it is built",
}


@hookimpl
def tactbench_estimators():
    return [
        EstimatorDescriptor(name=name, title=title, kinds=KINDS, where=f"evil_tactile.answers:{name.replace('-', '_')}")
        for name, title in ESTIMATORS.items()
    ] + [
        EstimatorDescriptor(
            name="evil-import", title="Aborts when it is imported", kinds=KINDS, where="evil_tactile.aborting:build"
        ),
        EstimatorDescriptor(
            name="evil-patch",
            title="Patches NumPy and scikit-learn when it is imported",
            kinds=KINDS,
            where="evil_tactile.patch:build",
        ),
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
