"""The rig that docs/plugins.md shows: its file is read and checked as the page says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture
def rig_check(tmp_path):
    """Install the page's rig, and run `tactbench doctor` on settings."""
    page = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n# acme_rig\.py\n(.*?)```", page, flags=re.DOTALL)
    (tmp_path / "acme_rig.py").write_text(code, encoding="utf-8")
    info = tmp_path / "acme_rig-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-rig\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[tactbench]\nacme-rig = acme_rig\n", encoding="utf-8")

    def run(settings):
        path = tmp_path / "rig.yaml"
        lines = ("version: 1", "rig: acme-press", "sensors: {icub: {link: emulated}}", f"settings: {settings}")
        path.write_text("\n".join(lines), encoding="utf-8")
        env = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "COLUMNS": "200", "PYTHONWARNINGS": "error"}
        return subprocess.run(
            [sys.executable, "-m", "tactbench", "doctor", "--seconds", "0", "--rig-file", str(path)],
            env=env, capture_output=True, text=True,
            timeout=60,
        )  # fmt: skip

    return run


@pytest.mark.parametrize(
    ("settings", "code", "said"),
    [
        ("{force_ceiling: 5}", 2, r"rig\.yaml:4.*force_ceiling_n"),
        ("{force_ceiling_n: 5}", 0, "5 N.*Nothing was opened"),
        ("{force_ceiling_n: 12}", 1, "refused: The frame bears 10 N.*12 N"),
    ],
)
def test_its_file_is_checked_and_its_check_is_printed(rig_check, settings, code, said):
    done = rig_check(settings)
    assert done.returncode == code, done.stderr
    assert re.search(said, done.stdout + done.stderr, re.DOTALL), done.stdout
