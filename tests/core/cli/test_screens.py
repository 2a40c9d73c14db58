"""Bad input ends in one clear screen, exit code 2, and nothing half-written."""

import os
import shlex
import subprocess
import sys

import pytest


def assert_one_clear_screen(done, *says):
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ") or "Usage:" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.splitlines()) <= 6
    for text in says:
        assert text in done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("run", "--sensor", "biotak", "--task", "force"), "Did you mean 'biotac'"),
        (("run", "--sensor", "biotac", "--task", "curvatur"), "Did you mean 'curvature'"),
        (("run", "--rig", "twim"), "Did you mean 'twin'"),
        (("run", "--protocol", "karl2017"), "Did you mean 'karl2016'"),
        (("run", "--task", "force", "--estimator", "laso"), "Did you mean 'lasso'"),
        (("run", "--task", "curvature", "--estimator", "lasso"), "classification"),
        (("run", "--config", "nowhere.yaml"), "nowhere.yaml: cannot be read"),
        (("run", "--rig", "replay"), "--recordings"),
        (("run", "--rig", "replay", "--recordings", "nowhere"), "nowhere"),
        (("run", "--repeats", "0"), "--repeats"),
        (("run", "--repeats", "1000000000"), "--repeats"),
        (("run", "--timeout", "nan"), "nan is no finite number"),
        (("run", "--timeout", "inf"), "--timeout"),
        (("run", "--memory", "99999999999999999999"), "--memory"),
        (("run", "--task", "force", "--recordings", os.devnull), f"{os.devnull} is no folder"),
        (("report", os.devnull), f"{os.devnull} is no folder"),
        (("leaderboard", os.devnull), f"{os.devnull} is no folder"),
        (("runn",), "Did you mean 'run'"),
        (("show", "biotak"), "Did you mean 'biotac'"),
        (("inspect", "nowhere.h5"), "nowhere.h5"),
        (("import", "nowhere.yaml"), "nowhere.yaml"),
        (("leaderboard",), "tactbench run"),
    ],
)
def test_wrong_words_are_answered_with_the_next_step(verbs, arguments, says):
    assert_one_clear_screen(verbs(*arguments, code=2), says)


def test_a_wrong_word_leaves_no_result_behind(shell):
    shell("run", "--sensor", "biotak", code=2)
    files = {path.name for path in shell.folder.rglob("*") if path.is_file() and "cache" not in path.parts}
    assert files <= {".lock"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("tasks: [force]\nsensor: [biotac]\n", "matrix.yaml:2: the key 'sensor' is not known"),
        ("tasks: [force]\nrepeats: three\n", "matrix.yaml:2: repeats"),
        ("tasks: [force\n", "matrix.yaml:2"),
        ("tasks: [force]\nrepeats: 1000000000\n", "matrix.yaml:2: repeats"),
        ("tasks: [force]\ntimeout_s: .nan\n", "matrix.yaml:2: timeout_s"),
        ("tasks: [force]\nmemory_mb: 99999999999999999999\n", "matrix.yaml:2: memory_mb"),
    ],
)
def test_a_wrong_matrix_names_file_and_line(verbs, text, says):
    (verbs.folder / "matrix.yaml").write_text(text)
    assert_one_clear_screen(verbs("run", "--config", "matrix.yaml", code=2), says)


def test_a_folder_that_cannot_be_written(verbs):
    (verbs.folder / "taken").write_text("a file, not a folder")
    done = verbs("run", "--sensor", "icub", "--task", "force", "--out", "taken/results", code=2)
    assert_one_clear_screen(done, "--out DIR")


def test_help_imports_no_verb_and_importing_tactbench_loads_nothing_heavy():
    heavy = {"h5py", "sklearn", "scipy", "matplotlib", "serial", "can", "rich", "numpy", "pydantic", "pluggy"}
    script = (
        "import sys, tactbench\n"
        "from tactbench.core.cli import cli\n"
        "try: cli.main(['--help'], prog_name='tactbench')\n"
        "except SystemExit: pass\n"
        f"print('HEAVY', sorted({heavy!r} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    assert "HEAVY []" in done.stdout
    assert "curvature" in done.stdout


def test_listing_loads_no_numerics():
    script = (
        "import sys\n"
        "from tactbench.core.plugins.registry import load_registry\n"
        "assert not load_registry().failures, load_registry().failures\n"
        "heavy = {'h5py', 'sklearn', 'scipy', 'matplotlib', 'serial', 'can', 'rich'}\n"
        "print('HEAVY', sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60,
                          env={**os.environ, "PYTHONWARNINGS": "error"})  # fmt: skip
    assert "HEAVY []" in done.stdout


def test_table_one_of_the_paper(verbs):
    shown = verbs("show", "biotac", "icub").stdout
    rows = {line.split("  ")[0].strip(): line for line in (line.strip() for line in shown.splitlines()) if line}
    for title, biotac in (
        ("# taxels", "19"), ("measurement principle", "resistive"), ("DC Pressure Range", "0–100 kPa"),
        ("DC Temp. Range", "0–75"), ("AC Pressure spectrum", "10–1040 Hz"), ("AC Temp. spectrum", "0.45–22.6 Hz"),
    ):  # fmt: skip
        assert biotac in rows[title]
    assert "12" in rows["# taxels"]
    assert "capacitive" in rows["measurement principle"]
    assert rows["DC Pressure Range"].rstrip().endswith("-")


@pytest.mark.parametrize(("where", "says"), [("> /dev/full", "No space left on device"), (">&-", "is closed")])
def test_standard_output_that_cannot_be_written_is_one_error(tmp_path, where, says):
    command = f"{shlex.quote(sys.executable)} -m tactbench list {where}"
    done = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert_one_clear_screen(done, says)
