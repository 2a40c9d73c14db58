"""What two processes must agree in before one computes for the other."""

import json
import os
import shutil
import subprocess
import sys

from tactbench.core.matrix.dask import differences
from tests.conftest import THIRD_PARTY

ASK = """
import json
from tactbench.core.matrix.dask import environment
from tactbench.core.plugins.registry import installed
print(json.dumps(environment(installed())))
"""


def asked(*path):
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}
    done = subprocess.run([sys.executable, "-c", ASK], env=env, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_a_plugin_counts_with_every_byte(tmp_path):
    here = asked(THIRD_PARTY / "good")
    assert {"the source of tactbench", "the version of numpy", "the version of python"} <= set(here)
    shutil.copytree(THIRD_PARTY / "good", tmp_path / "good")
    (package,) = [path for path in (tmp_path / "good").iterdir() if (path / "__init__.py").exists()]
    assert differences(here, asked(tmp_path / "good")) == []
    (package / "beside.py").write_text("FACTOR = 2\n")
    source = f"the source of {package.name}"
    there = asked(tmp_path / "good")
    assert differences(here, there) == [f"{source} is {there[source]} there and {here[source]} here"]
    assert differences(here, asked()) == [f"{source} is missing there and {here[source]} here"]


def test_what_only_the_other_side_has_does_not_matter():
    here = {"the version of numpy": "2.1"}
    assert differences(here, {**here, "the source of acme": "1", "the version of daal": "3"}) == []
    assert differences(here, {"the version of numpy": "2.0"}) == ["the version of numpy is 2.0 there and 2.1 here"]
