"""Packages in real folders, put on the path of fresh interpreters."""

from pathlib import Path


def write_package(folder: Path, name: str, files: dict[str, str]) -> Path:
    """Write a package of `files` into `folder` and return its own folder."""
    package = folder / name
    for path, text in files.items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text)
    return package


def write_metadata(folder: Path, distribution: str, version: str, *, points: str = "", record: str = "") -> None:
    """Write what an installer leaves beside a package."""
    info = folder / f"{distribution.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
    if points:
        (info / "entry_points.txt").write_text(f"[tactbench]\n{points}\n")
    if record:
        (info / "RECORD").write_text(record)


ANSWERS = {
    "__init__.py": '''"""Estimators of a stranger."""
from tactbench.plugin import EstimatorDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_estimators():
    return [
        EstimatorDescriptor(name="acme", title="a constant, filtered", kinds=("regression",), where="acme.answers:acme",
                            params={"gain": 1.0}),
        EstimatorDescriptor(name="acme-raises", title="raises", kinds=("regression",), where="acme.answers:raises"),
    ]
''',
    "answers.py": """import numpy as np

from acme.filters import LAW


class Constant:
    def __init__(self, gain):
        self.gain = gain

    def fit(self, X, y):
        self.answer = self.gain * LAW * float(np.mean(y))
        return self

    def predict(self, X):
        return np.full(len(X), self.answer)


def acme(*, kind, seed, threads, gain):
    return Constant(gain)


class Raising:
    def fit(self, X, y):
        print("so far so good")
        raise RuntimeError("the pad came off")


def raises(*, kind, seed, threads):
    return Raising()
""",
    "filters.py": '"""Filters."""\n\nLAW = 0.75  # of the pad\n',
}


def write_acme(folder: Path) -> Path:
    """Write the plugin ``acme`` and return its package."""
    write_metadata(folder, "acme-answers", "1.0", points="acme = acme")
    return write_package(folder, "acme", ANSWERS)
