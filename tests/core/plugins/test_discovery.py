"""Plugins of other distributions, discovered through real dist-info by the command line."""

import json


def test_a_strangers_sensor_is_discovered_in_a_fresh_interpreter(shell):
    found = json.loads(shell("plugins", "--format", "json", plugins=("good",)).stdout)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "acme-tactile"]
    assert (row["status"], row["version"], row["brings"]) == ("loaded", "1.2.0", ["sensor acme-pad"])
    assert "acme-pad" in json.loads(shell("list", "sensors", "--format", "json", plugins=("good",)).stdout)["sensors"]
    brought = {thing for row in found["plugins"] if row["distribution"] == "tactbench" for thing in row["brings"]}
    assert {"sensor biotac", "rig twin", "rig replay", "task force", "estimator forest"} <= brought


def test_those_that_fail_are_reported_and_stop_nothing(verbs):
    plugins = ("good", "broken", "misspelt", "twin_name")
    found = json.loads(verbs("plugins", "--format", "json", plugins=plugins, code=1).stdout)
    reasons = {row["distribution"]: row["reason"] for row in found["plugins"] if row["status"] == "failed"}
    assert reasons.keys() == {"broken-tactile", "misspelt-tactile"}
    assert "the vendor library is not installed" in reasons["broken-tactile"]
    assert "tactbench_sensor" in reasons["misspelt-tactile"]
    (refusal,) = found["refused"]
    assert "acme-tactile" in refusal
    assert "copycat-tactile" in refusal
    listed = verbs("list", "sensors", plugins=plugins)
    assert "biotac" in listed.stdout
    assert "tactbench plugins" in listed.stderr
    run = ("run", "--sensor", "acme-pad", "--task", "force", "--repeats", "1")
    assert "copycat-tactile" in verbs(*run, plugins=plugins, code=2).stderr


def test_a_plugin_whose_import_ends_its_process_ends_no_run(shell, tmp_path):
    package, info = tmp_path / "site" / "vanishing.py", tmp_path / "site" / "vanishing-1.0.dist-info"
    info.mkdir(parents=True)
    package.write_text("import os\nos._exit(0)\n")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: vanishing\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tactbench]\nvanishing = vanishing\n")
    run = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "ols", "--no-latency")
    assert "ideal" in shell(*run, plugins=(str(tmp_path / "site"),)).stdout
