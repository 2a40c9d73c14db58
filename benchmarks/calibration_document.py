"""Put a finished calibration in the place of the one that comes along, and its tables at the end of the document.

`tactbench calibrate --jobs 2 --out RESULTS` draws; then this copies the draws, the procedure and what was looked at
beside them from RESULTS/calibration to calibration/, and replaces docs/calibration.md from the calibration's title on.
Without RESULTS only the document is written anew. What stands above the tables is written by hand.

Usage: python benchmarks/calibration_document.py [RESULTS]
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from tactbench.core.calibration.result import DRAWS, RUN, VARIATIONS, load_result
from tactbench.core.calibration.summary import summary
from tactbench.core.calibration.tables import markdown

HERE = Path(__file__).resolve().parents[1]
DOCUMENT = HERE / "docs" / "calibration.md"


def main() -> None:
    """Copy and write."""
    if len(sys.argv) > 1:
        for name in (DRAWS, RUN, VARIATIONS):
            shutil.copyfile(Path(sys.argv[1]) / "calibration" / name, HERE / "calibration" / name)
    result = load_result()
    assert result is not None, "calibration/ holds no finished calibration"
    text = DOCUMENT.read_text(encoding="utf-8")
    above = text[: text.index(f"## {result.spec.title}")]
    DOCUMENT.write_text(above + markdown(result, summary(result)), encoding="utf-8")
    print(f"{DOCUMENT}: {len(result.draws)} draws")


if __name__ == "__main__":
    main()
