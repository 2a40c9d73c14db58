"""Provenance: equal for equal circumstances, silent about people and places, and said in sentences."""

import getpass
import json
import os
import platform
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

from tactbench.core.plugins.registry import installed, load_registry
from tactbench.core.provenance import _commit, cpu_model, gather, host_id, source_digest, usable_cores
from tests.conftest import ROOT
from tests.core.matrix.plugin_packages import write_acme


def gathered(**circumstances):
    return gather(installed(), **circumstances)


def git(folder, *arguments):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    return subprocess.check_output(["git", "-C", str(folder), *identity, *arguments], text=True)


def test_the_commit_says_whether_files_differ_from_it(tmp_path):
    package = tmp_path / "checkout" / "package"
    package.mkdir(parents=True)
    (package / "law.py").write_text("LAW = 3\n")
    assert _commit(package) == ""
    git(tmp_path, "init", "-q", str(package.parent))
    git(package, "add", ".")
    git(package, "commit", "-qm", "first")
    head = git(package, "rev-parse", "HEAD")[:12]
    assert _commit(package) == head
    (package / "law.py").write_text("LAW = 4\n")
    assert _commit(package) == f"{head}+changes"


def test_equal_circumstances_give_equal_provenance_without_clock_person_host_or_path():
    found = gathered(seed=1, engine="isolated")
    assert found == gathered(seed=1, engine="isolated") != gathered(seed=2, engine="isolated")
    text = json.dumps(found)
    for private in (platform.node(), str(Path.home()), str(ROOT), sys.prefix, time.strftime("%Y-%m-%d")):
        assert private not in text
    assert getpass.getuser() not in found.values()
    assert found["distributions"]["numpy"] == metadata.version("numpy")
    assert (found["seed"], found["host"], len(host_id())) == (1, host_id(), 12)
    assert found["threads"] == os.environ["OMP_NUM_THREADS"]


def test_machines_differ_by_processor_and_cores(monkeypatch):
    assert f"model name\t: {cpu_model()}\n" in Path("/proc/cpuinfo").read_text()
    assert usable_cores() == len(os.sched_getaffinity(0))
    host, _ = host_id(), [one.cache_clear() for one in (host_id, cpu_model)]
    monkeypatch.delattr(os, "sched_getaffinity")
    for cores, usable in ((None, 1), (3, 3)):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        assert usable_cores() == usable
    assert host_id() != host
    for name, shown in (("", "unknown"), ("x86", "x86")):
        monkeypatch.setattr(platform, "processor", lambda name=name: name)
        monkeypatch.setattr(Path, "read_text", lambda _: "no model")
        cpu_model.cache_clear()
        assert cpu_model() == shown
    monkeypatch.undo()
    _ = [one.cache_clear() for one in (host_id, cpu_model)]


def test_a_strangers_plugin_is_told_with_its_source(tmp_path, monkeypatch):
    acme = write_acme(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (point,) = metadata.Distribution.at(tmp_path / "acme_answers-1.0.dist-info").entry_points

    registry = load_registry([point])
    (before,) = gather(registry)["plugins"]
    assert (before["distribution"], before["version"], before["package"]) == ("acme-answers", "1.0", "acme")
    (acme / "filters.py").write_text("LAW = 0.75\n")
    source_digest.cache_clear()
    assert gather(registry)["plugins"][0]["source"] != before["source"]
