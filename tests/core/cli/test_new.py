"""``tactbench new``: every kind of package, as it is made, is typed, formatted, checked and in the leaderboard."""

import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec

import pytest

from tactbench.core.cli.new import KINDS
from tests.conftest import ROOT, Verbs


def install(folder, name):
    """Leave what an installer leaves beside a package."""
    module = f"tactbench_{name.replace('-', '_')}"
    info = folder / f"{module}-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: tactbench-{name}\nVersion: 0.1.0\nSummary: made\n")
    (info / "entry_points.txt").write_text(f"[tactbench]\n{name} = {module}\n")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A package of every kind, each in a folder of its own, named ``my-KIND``."""
    top = tmp_path_factory.mktemp("made")
    for kind in KINDS:
        Verbs(top)("new", kind, f"my-{kind}", "--into", kind)
        install(top / kind, f"my-{kind}")
    return top


def folders(made):
    return tuple(str(made / kind) for kind in KINDS)


@pytest.mark.skipif(not (find_spec("ruff") and find_spec("mypy")), reason="needs ruff and mypy: pip install '.[dev]'")
def test_what_is_made_is_formatted_and_typed(made):
    def run(*command):
        done = subprocess.run([sys.executable, "-m", *command], cwd=made, capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stdout + done.stderr

    run("ruff", "check", "--no-cache", ".")
    run("ruff", "format", "--no-cache", "--check", ".")
    config = made / "mypy.ini"
    path = ":".join([str(ROOT), *folders(made)])
    # Errors in tactbench itself are not these packages': its own check finds them.
    config.write_text(f"[mypy]\nstrict = True\nmypy_path = {path}\n[mypy-tactbench.*]\nfollow_imports = silent\n")
    packages = [word for kind in KINDS for word in ("-p", f"tactbench_my_{kind}")]
    run("mypy", "--config-file", str(config), "--cache-dir", str(ROOT / ".mypy_cache" / "made"), *packages)


def test_every_kind_passes_its_checks(made):
    code = "\n".join(
        ["from tactbench import testing", *(f"print(*testing.check_plugin('my-{kind}'), flush=True)" for kind in KINDS)]
    )
    path = os.pathsep.join([str(ROOT), *folders(made)])
    env = {**os.environ, "PYTHONPATH": path, "PYTHONWARNINGS": "error", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=made, env=env, capture_output=True, text=True, timeout=100, check=True
    )
    ends = re.findall(r"^(\w+) my-\w+: passed \d+, failed (\d+), .*Level: (\w+)", done.stdout, re.MULTILINE)
    # Silver: nobody has measured a unit of theirs, which gold would take.
    assert ends == [(kind, "0", "silver") for kind in KINDS], done.stdout


def test_the_sensor_runs_with_the_estimator_and_the_effect_and_the_task_on_the_rig(tmp_path, made):
    def scores(*asked):
        asked = ("run", "--repeats", "1", "--format", "json", "--sensor", "my-sensor", *asked)
        rows = json.loads(Verbs(tmp_path, here=True)(*asked, plugins=folders(made)).stdout)
        return {row["estimator"]: row["score"] for row in rows}

    found = scores("--task", "force", "--estimator", "my-estimator", "--effects", "+my-effect")
    assert found["my-estimator"] < found["mean"] / 2
    # Its taxels all answer alike: nobody can say on which side they are touched.
    assert 0 < scores("--task", "my-task", "--rig", "my-rig")["logistic"] < 0.6


def test_nothing_is_overwritten(verbs, tmp_path):
    (tmp_path / "README.md").write_text("mine")
    done = verbs("new", "task", "mine", code=2)
    assert "README.md" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]
    assert (tmp_path / "README.md").read_text() == "mine"
