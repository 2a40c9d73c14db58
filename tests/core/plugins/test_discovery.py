"""Plugins of strangers, discovered through real dist-info in a fresh interpreter."""

import json

import pytest


def plugins(shell, *folders, code):
    return json.loads(shell("plugins", "--format", "json", plugins=folders, code=code).stdout)


def test_a_strangers_sensor_is_discovered_and_listed(shell):
    found = plugins(shell, "good", code=0)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "acme-tactile"]
    assert (row["status"], row["version"], row["brings"]) == ("loaded", "1.2.0", ["sensor acme-pad"])
    assert "acme-pad" in json.loads(shell("list", "sensors", "--format", "json", plugins=("good",)).stdout)["sensors"]


def test_one_that_raises_on_import_is_reported_and_stops_nothing(shell):
    found = plugins(shell, "good", "broken", code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "broken-tactile"]
    assert row["status"] == "failed"
    assert "the vendor library is not installed" in row["reason"]
    others = {row["status"] for row in found["plugins"] if row["distribution"] != "broken-tactile"}
    assert others == {"loaded"}
    listed = shell("list", "sensors", plugins=("good", "broken"))
    assert "acme-pad" in listed.stdout
    assert "tactbench plugins" in listed.stderr


def test_two_with_one_name_are_refused_naming_both(shell):
    (refusal,) = plugins(shell, "good", "twin_name", code=1)["refused"]
    assert "acme-tactile" in refusal
    assert "copycat-tactile" in refusal
    done = shell(
        "run", "--repeats", "1", "--sensor", "acme-pad", "--task", "force", plugins=("good", "twin_name"), code=2
    )
    assert "acme-tactile" in done.stderr
    assert "copycat-tactile" in done.stderr
    assert "biotac" in shell("list", "sensors", plugins=("good", "twin_name")).stdout


def test_a_misspelt_hook_is_an_error(shell):
    found = plugins(shell, "misspelt", code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "misspelt-tactile"]
    assert "tactbench_sensor" in row["reason"]


def test_a_plugin_for_another_api_version_is_refused(shell, tmp_path):
    package = tmp_path / "site" / "old_tactile"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("TACTBENCH_API = 0\n")
    info = tmp_path / "site" / "old_tactile-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: old-tactile\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tactbench]\nold = old_tactile\n")
    found = plugins(shell, str(tmp_path / "site"), code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "old-tactile"]
    assert "TACTBENCH_API = 0" in row["reason"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("import os\nos._exit(0)", "exit code 0"),
        ("import os\nos.abort()", "SIGABRT"),
        ("raise SystemExit(0)", "SystemExit"),
    ],
    ids=["vanishes", "aborts", "exits"],
)
def test_one_whose_import_ends_its_process_ends_no_command(shell, tmp_path, text, says):
    package = tmp_path / "site" / "ending_tactile"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(text + "\n")
    info = tmp_path / "site" / "ending_tactile-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: ending-tactile\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tactbench]\nending = ending_tactile\n")
    found = plugins(shell, str(tmp_path / "site"), code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "ending-tactile"]
    assert says in row["reason"]
    listed = shell("list", "sensors", plugins=(str(tmp_path / "site"),))
    assert "biotac" in listed.stdout
    assert "tactbench plugins" in listed.stderr
    run = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "ols", "--no-latency")
    assert "ideal" in shell(*run, plugins=(str(tmp_path / "site"),)).stdout


def test_ours_come_in_by_the_same_door(shell):
    found = plugins(shell, code=0)
    brought = {thing for row in found["plugins"] if row["distribution"] == "tactbench" for thing in row["brings"]}
    expected = {"sensor biotac", "sensor icub", "sensor ideal", "rig twin", "rig replay", "task force",
                "task curvature", "task grasp-stability", "estimator lasso", "estimator forest"}  # fmt: skip
    assert expected <= brought
