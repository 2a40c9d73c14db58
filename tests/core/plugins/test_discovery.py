"""Plugins of strangers, discovered through real dist-info; one of them in a fresh interpreter."""

import json


def plugins(call, *folders, code):
    return json.loads(call("plugins", "--format", "json", plugins=folders, code=code).stdout)


def test_a_strangers_sensor_is_discovered_and_listed(shell):
    found = plugins(shell, "good", code=0)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "acme-tactile"]
    assert (row["status"], row["version"], row["brings"]) == ("loaded", "1.2.0", ["sensor acme-pad"])
    assert "acme-pad" in json.loads(shell("list", "sensors", "--format", "json", plugins=("good",)).stdout)["sensors"]


def test_one_that_raises_on_import_is_reported_and_stops_nothing(verbs):
    found = plugins(verbs, "good", "broken", code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "broken-tactile"]
    assert row["status"] == "failed"
    assert "the vendor library is not installed" in row["reason"]
    others = {row["status"] for row in found["plugins"] if row["distribution"] != "broken-tactile"}
    assert others == {"loaded"}
    listed = verbs("list", "sensors", plugins=("good", "broken"))
    assert "acme-pad" in listed.stdout
    assert "tactbench plugins" in listed.stderr


def test_two_with_one_name_are_refused_naming_both(verbs):
    (refusal,) = plugins(verbs, "good", "twin_name", code=1)["refused"]
    assert "acme-tactile" in refusal
    assert "copycat-tactile" in refusal
    done = verbs(
        "run", "--repeats", "1", "--sensor", "acme-pad", "--task", "force", plugins=("good", "twin_name"), code=2
    )
    assert "acme-tactile" in done.stderr
    assert "copycat-tactile" in done.stderr
    assert "biotac" in verbs("list", "sensors", plugins=("good", "twin_name")).stdout


def test_a_misspelt_hook_is_an_error(verbs):
    found = plugins(verbs, "misspelt", code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "misspelt-tactile"]
    assert "tactbench_sensor" in row["reason"]


def installed_in(site, name, text):
    """Install the plugin ``NAME-tactile``, whose code is `text`."""
    package = site / f"{name}_tactile"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(text + "\n")
    info = site / f"{name}_tactile-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}-tactile\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[tactbench]\n{name} = {name}_tactile\n")


def test_a_plugin_for_another_api_version_is_refused(verbs, tmp_path):
    installed_in(tmp_path / "site", "old", "TACTBENCH_API = 0")
    found = plugins(verbs, str(tmp_path / "site"), code=1)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "old-tactile"]
    assert "TACTBENCH_API = 0" in row["reason"]


ENDS = {
    "vanishing": ("import os\nos._exit(0)", "exit code 0"),
    "aborting": ("import os\nos.abort()", "SIGABRT"),
    "exiting": ("raise SystemExit(0)", "SystemExit"),
}


def test_those_whose_imports_end_their_processes_end_no_command(shell, tmp_path):
    for name, (text, _) in ENDS.items():
        installed_in(tmp_path / "site", name, text)
    found = plugins(shell, str(tmp_path / "site"), code=1)
    reasons = {row["distribution"]: row["reason"] for row in found["plugins"]}
    for name, (_, says) in ENDS.items():
        assert says in reasons[f"{name}-tactile"]
    listed = shell("list", "sensors", plugins=(str(tmp_path / "site"),))
    assert "biotac" in listed.stdout
    assert "tactbench plugins" in listed.stderr
    run = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "ols", "--no-latency")
    assert "ideal" in shell(*run, plugins=(str(tmp_path / "site"),)).stdout


def test_ours_come_in_by_the_same_door(verbs):
    found = plugins(verbs, code=0)
    brought = {thing for row in found["plugins"] if row["distribution"] == "tactbench" for thing in row["brings"]}
    expected = {"sensor biotac", "sensor icub", "sensor ideal", "rig twin", "rig replay", "task force",
                "task curvature", "task grasp-stability", "estimator lasso", "estimator forest"}  # fmt: skip
    assert expected <= brought
