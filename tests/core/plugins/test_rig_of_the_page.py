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
    """Install the page's rig, and run `tactbench rig check` on settings."""
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
            [sys.executable, "-m", "tactbench", "rig", "check", str(path)], env=env, capture_output=True, text=True,
            timeout=60,
        )  # fmt: skip

    return run


def test_its_file_is_refused_with_the_line(rig_check):
    done = rig_check("{force_ceiling: 5}")
    assert done.returncode == 2, done.stderr
    assert "rig.yaml:4" in done.stderr
    assert "force_ceiling_n" in done.stderr


@pytest.mark.parametrize(("ceiling", "code", "said"), [(5, 0, "Nothing is refused"), (12, 1, "The frame bears 10 N")])
def test_its_check_is_printed(rig_check, ceiling, code, said):
    done = rig_check(f"{{force_ceiling_n: {ceiling}}}")
    assert done.returncode == code, done.stderr
    assert said in done.stdout
    assert f"{ceiling} N" in done.stdout
