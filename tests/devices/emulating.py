"""Emulated devices in real time, as a user starts them beside a recording."""

from __future__ import annotations

import subprocess
import sys
from contextlib import contextmanager

import yaml

from tactbench.plugin.devices import RigFile


@contextmanager
def emulating(file: RigFile, folder):
    """Run `tactbench emulate` with a rig file; yield the rig file that opens its devices."""
    given, printed = folder / "emulated.yaml", folder / "opening.yaml"
    given.write_text(yaml.safe_dump(file.model_dump(mode="json", exclude_defaults=True)), encoding="utf-8")
    words = [sys.executable, "-m", "tactbench", "emulate", "--rig-file", str(given)]
    with (
        printed.open("w", encoding="utf-8") as out,
        subprocess.Popen(words, stdout=out, stderr=subprocess.PIPE, text=True) as process,
    ):
        try:
            remarks = iter(process.stderr)
            # The last remark stands below the whole file.
            assert any("tactbench record" in line for line in remarks)
            yield RigFile.model_validate(yaml.safe_load(printed.read_text(encoding="utf-8")))
        finally:
            process.kill()
