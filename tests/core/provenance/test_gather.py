"""Provenance: equal for equal circumstances, silent about people and places, and said in sentences."""

import getpass
import json
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tactbench.core.provenance.checkout import checkout_of
from tactbench.core.provenance.gather import foot, gather, host_id
from tests.conftest import ROOT
from tests.core.matrix.plugin_packages import write_acme


def git(folder, *arguments):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    subprocess.run(["git", "-C", str(folder), *identity, *arguments], check=True, capture_output=True)


@pytest.fixture
def checkout(tmp_path):
    folder = tmp_path / "checkout"
    (folder / "package").mkdir(parents=True)
    (folder / "package" / "law.py").write_text("LAW = 3\n")
    (folder / "tests.py").write_text("")
    git(folder.parent, "init", "-q", str(folder))
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    return folder


def test_a_clean_checkout_is_its_commit(checkout):
    found = checkout_of(checkout / "package")
    head = subprocess.run(["git", "-C", str(checkout), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    assert str(found) == head.stdout[:12]


def test_what_is_not_committed_has_a_digest_of_its_own(checkout):
    law, new = checkout / "package" / "law.py", checkout / "package" / "new.py"
    seen = [str(checkout_of(checkout / "package"))]
    for path, text in ((law, "LAW = 4\n"), (law, "LAW = 5\n"), (new, "A = 1\n"), (new, "A = 2\n")):
        path.write_text(text)
        seen.append(str(checkout_of(checkout / "package")))
    assert len(set(seen)) == len(seen)
    assert len({text.partition("+")[0] for text in seen}) == 1
    new.unlink()
    law.write_text("LAW = 4\n")
    assert str(checkout_of(checkout / "package")) == seen[1]
    law.write_text("LAW = 3\n")
    assert str(checkout_of(checkout / "package")) == seen[0]


def test_what_lies_beside_the_package_does_not_count(checkout):
    before = checkout_of(checkout / "package")
    (checkout / "tests.py").write_text("assert True\n")
    (checkout / "package" / "notes.txt").write_text("untracked, and no Python")
    assert checkout_of(checkout / "package") == before


def test_no_checkout_and_one_without_a_commit_are_no_state(tmp_path):
    assert checkout_of(tmp_path) is None
    git(tmp_path, "init", "-q", ".")
    assert checkout_of(tmp_path) is None


def test_equal_circumstances_give_equal_provenance_and_there_is_no_clock_in_it():
    assert gather(seed=1, jobs=2) == gather(seed=1, jobs=2)
    assert gather(seed=1) != gather(seed=2)
    text = json.dumps(gather())
    assert time.strftime("%Y-%m-%d") not in text
    assert str(os.getpid()) not in json.dumps({**gather(), "distributions": {}, "commit": "", "host": ""}).split('"')


def test_it_names_no_person_host_or_path():
    text = json.dumps(gather())
    for private in (platform.node(), str(Path.home()), str(ROOT), sys.prefix, str(Path.cwd())):
        assert private not in text
    assert getpass.getuser() not in json.loads(text).values()


def test_it_says_what_the_numbers_were_made_with():
    import numpy
    import threadpoolctl

    found = gather(jobs=2)
    assert found["distributions"]["numpy"] == numpy.__version__
    assert found["jobs"] == 2
    assert found["host"] == host_id()
    assert found["memory_mb"] > 0
    libraries = [library for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"]
    assert any(found["blas"]["version"].startswith(library["version"].partition(".dev")[0]) for library in libraries)


def test_it_is_the_same_before_and_after_numpy_is_loaded(tmp_path):
    text = """
import json, sys
from tactbench.core.provenance.gather import gather
before = gather()
assert "numpy" not in sys.modules
import numpy
assert json.dumps(gather()) == json.dumps(before)
"""
    subprocess.run([sys.executable, "-c", text], check=True, cwd=tmp_path)


def test_a_strangers_plugin_is_told_with_its_source_and_its_checkout(tmp_path):
    acme = write_acme(tmp_path)
    git(tmp_path, "init", "-q", ".")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    text = "import json; from tactbench.core.provenance.gather import gather; print(json.dumps(gather()['plugins']))"

    def told():
        path = os.pathsep.join([str(tmp_path), str(ROOT)])
        env = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run([sys.executable, "-c", text], check=True, capture_output=True, text=True, env=env)
        return json.loads(done.stdout)

    (before,) = told()
    assert (before["distribution"], before["version"], before["package"]) == ("acme-answers", "1.0", "acme")
    (acme / "filters.py").write_text("LAW = 0.75\n")
    (commented,) = told()
    assert commented["source"] != before["source"], "every byte counts"
    assert commented["commit"].startswith(before["commit"] + "+")


def test_the_foot_says_each_thing_once():
    one = gather(jobs=1)
    assert foot([one, one]) == foot([one])
    software, place = foot([one])[0], foot([one])[-1]
    assert software.startswith(f"tactbench {one['tactbench']}")
    assert f"numpy {one['distributions']['numpy']}" in software
    assert one["host"] in place
    assert "at once" not in place
    assert "2 cells at once" in foot([{**one, "jobs": 2}])[-1]


def test_the_foot_warns_of_several_hosts():
    one = gather()
    said = foot([one, {**one, "host": "another"}])
    assert said[-1] == "2 hosts: times of one are not to be compared with times of another."


@pytest.mark.parametrize("one", [{}, {"host": "h"}, {"tactbench": "1"}])
def test_the_foot_of_something_incomplete_says_what_there_is(one):
    assert len(foot([one])) == len(one)
