"""Estimators and rigs that do the worst that any has been seen to do: each of them may cost its own rows only."""

from tactbench.plugin import EstimatorDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 1
KINDS = ("regression", "classification")
ESTIMATORS = {
    "evil-raise": "Raises",
    "evil-exit": "Leaves by sys.exit",
    "evil-interrupt": "Pretends that the user has pressed Ctrl-C",
    "evil-abort": "Aborts, as in a segmentation fault",
    "evil-vanish": "Ends its process without a word",
    "evil-hang": "Never comes back",
    "evil-deaf": "Never comes back, and listens to no signal that one can be deaf to",
    "evil-eat": "Takes memory without end",
    "evil-shape": "Answers with the wrong number of rows",
    "evil-nan": "Answers with what is no number",
    "evil-text": "Answers with text",
    "evil-print": "Prints, at every level, and answers honestly",
    "evil-fork": "Forks, and comes back twice",
    "evil-daemon": "Leaves a process behind that has left its group, and answers honestly",
    "evil-scribble": "Writes rubbish over every file of the result folder's cells",
    "evil-kill": "Kills its whole group of processes",
    "evil-lie": "Changes how scores are computed",
    "evil-promise": "Writes the beginning of a result that would never end",
    "evil-built-elsewhere": "Changes the working folder when it is built",
    "evil-built-deaf": "Ignores the ends of processes when it is built",
    "evil-built-limited": "Lowers the number of files that may be open when it is built",
    "evil-built-kill": "Kills its whole group of processes when it is built",
}


@hookimpl
def tactbench_estimators():
    return [
        EstimatorDescriptor(name=name, title=title, kinds=KINDS, where=f"evil_tactile.answers:{name.replace('-', '_')}")
        for name, title in ESTIMATORS.items()
    ] + [
        EstimatorDescriptor(
            name="evil-import", title="Aborts when it is imported", kinds=KINDS, where="evil_tactile.bomb:build"
        ),
        EstimatorDescriptor(
            name="evil-patch",
            title="Patches scikit-learn when it is imported",
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
            ("leaving", "Leaves by sys.exit when it is built", True),
            ("closed", "Will not open", True),
            ("dying", "Aborts in the second scene", True),
            ("stuck", "Hangs in the second scene", True),
            ("device", "A device that hangs in the second scene and must be let go of", False),
        )
    ]
