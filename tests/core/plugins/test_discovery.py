"""Plugins of other distributions, discovered through real dist-info by the command line."""

import json


def test_those_that_fail_are_reported_and_stop_nothing(verbs):
    plugins = ("good", "broken", "misspelt", "twin_name")
    found = json.loads(verbs("list", "plugins", "--format", "json", plugins=plugins, code=1).stdout)
    (row,) = [row for row in found["plugins"] if row["distribution"] == "acme-tactile"]
    assert (row["status"], row["version"], row["brings"]) == ("loaded", "1.2.0", ["sensor acme-pad"])
    reasons = {row["distribution"]: row["reason"] for row in found["plugins"] if row["status"] == "failed"}
    assert reasons.keys() == {"broken-tactile", "misspelt-tactile"}
    assert "the vendor library is not installed" in reasons["broken-tactile"]
    assert "tactbench_sensor" in reasons["misspelt-tactile"]
    (refusal,) = found["refused"]
    assert "acme-tactile" in refusal
    assert "copycat-tactile" in refusal
    listed = verbs("list", "sensors", plugins=plugins)
    assert "biotac" in listed.stdout
    assert "tactbench list plugins" in listed.stderr
    run = ("run", "--sensor", "acme-pad", "--task", "force", "--repeats", "1")
    assert "copycat-tactile" in verbs(*run, plugins=plugins, code=2).stderr
