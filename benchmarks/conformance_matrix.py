"""Print which checks fail which plugin of the shelf: each flaw is to be found by the check that is meant for it, alone.

Usage: python -m benchmarks.conformance_matrix
Exit code 1 if a flaw is found by another check, by several, or by none.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

SHELF = Path(__file__).resolve().parents[1] / "tests" / "third_party" / "flawed"


def main() -> int:
    """Run every check on every plugin of the shelf and print a line for each."""
    with TemporaryDirectory() as folder:
        return _matrix(Path(folder))


def _matrix(folder: Path) -> int:
    sys.path.insert(0, str(SHELF))
    from flawed_tactile import CAUGHT_BY, rig_file  # type: ignore[import-not-found]

    from tactbench.core.conformance.check import Mode
    from tactbench.core.conformance.run import run_checks, subjects_named
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    matched = flaws = 0
    checks = set()
    for kind, rows in CAUGHT_BY.items():
        for name, meant in rows.items():
            (subject,) = subjects_named(registry, name, (kind,))
            modes: tuple[Mode, ...] = ("passive",)
            text, path = rig_file(kind, name), None
            if text is not None:
                path, modes = folder / "rig.yaml", ("passive", "invasive")
                path.write_text(text, encoding="utf-8")
            found = [one.check for one in run_checks(subject, modes=modes, rig_file=path, isolated=False).failed]
            right = found == ([meant] if meant else [])
            matched, flaws = matched + right, flaws + 1
            checks.update(found)
            print(f"{'=' if right else '!'} {kind:<9} {name:<42} {', '.join(found) or 'nothing'}")
    print(f"{matched} of {flaws} one to one; {len(checks)} checks have found something")
    return 0 if matched == flaws else 1


if __name__ == "__main__":
    sys.exit(main())
