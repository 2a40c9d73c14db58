"""Plugins of other distributions, discovered through real dist-info by the command line."""

import json


def test_those_that_fail_are_reported_and_stop_nothing(verbs):
    plugins = ("good", "broken", "twin_name")
    found = json.loads(verbs("list", "plugins", "--format", "json", plugins=plugins, code=1).stdout)
    status = {row["distribution"]: row["status"] for row in found["plugins"] if row["distribution"] != "tactbench"}
    assert status == {"acme-tactile": "loaded", "copycat-tactile": "loaded", "broken-tactile": "failed"}
    assert len(found["refused"]) == 1
    listed = verbs("list", "sensors", plugins=plugins)
    assert "biotac" in listed.stdout
    assert "tactbench list plugins" in listed.stderr
    run = ("run", "--sensor", "acme-pad", "--task", "force", "--repeats", "1")
    assert "copycat-tactile" in verbs(*run, plugins=plugins, code=2).stderr
