"""Public data sets by name, served by this machine: fetched once, checked, and imported."""

import hashlib
import json
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest

import tactbench
from tactbench.core.errors import ConfigError, MissingRecordingError, NotApplicable, UnknownNameError
from tactbench.core.plugins.registry import load_registry
from tactbench.core.recording.datasets import DataSet, dataset_called, datasets
from tactbench.core.study.files import matrix_called
from tests.conftest import ROOT, Verbs
from tests.core.matrix.plugin_packages import write_metadata
from tests.core.recording.mapping.made import write_mapping

MAPPINGS = ROOT / "examples" / "mappings"
ROWS = "".join(f"{row},{row * 3 % 7}\n" for row in range(20))
PRESSES = {f"press_{name}.csv": f"{ROWS}99,{name}\n".encode() for name in "123"}


class Handler(BaseHTTPRequestHandler):
    """Serves the server's `files`; of `cut` it sends half and hangs up."""

    def do_GET(self):
        name = self.path.removeprefix("/")
        self.server.asked.append(name)
        body = self.server.files[name]
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body[: len(body) // 2] if name == self.server.cut else body)

    def log_message(self, *_):
        pass


@pytest.fixture
def server():
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as one:
        one.files, one.cut, one.asked = dict(PRESSES), "", []
        one.address = f"http://127.0.0.1:{one.server_port}/"
        Thread(target=one.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield one
        one.shutdown()


@pytest.fixture(autouse=True)
def kept(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setenv("TACTBENCH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def digests(files):
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def described(folder, address="", name="pad", **change):
    """A data set of three recordings, one file each."""
    text = f"""
        clock: none
        tables: {{table: {{files: press_*.csv, read: {{format: csv, header: false}}}}}}
        streams:
          taxels: {{table: table, channels: [{{columns: 0..1, name: "t{{column}}", kind: taxel, unit: count}}]}}
        source: {{address: "{address}", licence: MIT, citation: nobody, measured: nothing, tasks: [force], bytes: 1}}
    """
    folder.mkdir(parents=True, exist_ok=True)
    change |= {"sensor__name": name, "source__files": digests(PRESSES)}
    return DataSet(write_mapping(folder / f"{name}.yaml", text, **change))


def test_it_is_fetched_and_imported_once(tmp_path, server, kept):
    pad = described(tmp_path, server.address)
    folder = pad.recordings()
    assert kept in folder.parents
    first, *others = tactbench.dataset(str(pad.path))
    assert first.streams["taxels"].data[-1].tolist() == [99, 1]
    assert len(others) == 2
    assert sorted(server.asked) == sorted(PRESSES), "nothing is fetched twice"


def test_what_was_cut_short_or_is_another_file_is_not_kept_and_the_next_attempt_goes_on(tmp_path, server):
    pad = described(tmp_path, server.address)
    server.cut = "press_2.csv"
    with pytest.raises(MissingRecordingError, match=r"press_2\.csv"):
        pad.recordings()
    server.cut, server.files["press_2.csv"] = "", b"1,2\n"
    with pytest.raises(MissingRecordingError, match=digests(PRESSES)["press_2.csv"]):
        pad.recordings()
    assert [path.name for path in pad.files.iterdir()] == ["press_1.csv"]
    assert not pad.imported.exists()
    server.files, server.asked = PRESSES, []
    pad.recordings()
    assert server.asked == ["press_2.csv", "press_3.csv"]
    server.shutdown()
    server.server_close()
    offline = described(tmp_path, server.address, "other")
    with pytest.raises(MissingRecordingError, match=f"{server.address}press_1.csv") as found:
        offline.recordings()
    assert "--root" in found.value.hint


def test_what_lies_at_no_address_needs_a_copy_which_is_checked(tmp_path, server):
    pad, copy = described(tmp_path), tmp_path / "copy" / "pad"
    with pytest.raises(NotApplicable, match="press_1") as found:
        pad.recordings()
    assert "--root" in found.value.hint
    copy.mkdir(parents=True)
    for name, content in (PRESSES | {"press_3.csv": b"1,2\n"}).items():
        (copy / name).write_bytes(content)
    with pytest.raises(MissingRecordingError, match=digests(PRESSES)["press_3.csv"]):
        pad.recordings(copy)
    (copy / "press_3.csv").write_bytes(PRESSES["press_3.csv"])
    assert pad.recordings(copy) == pad.recordings(), "it is imported once"
    with pytest.raises(MissingRecordingError, match="cpoy"):
        pad.recordings(tmp_path / "cpoy")  # as before it was imported
    assert described(tmp_path, server.address, "other").recordings(copy.parent).is_dir()
    assert server.asked == []


def test_a_package_of_data_sets_alone_is_a_plugin_and_a_broken_one_costs_itself_alone(tmp_path, monkeypatch):
    described(tmp_path / "only_data" / "datasets")
    (tmp_path / "only_data" / "datasets" / "broken.yaml").write_text("version: 1\n")
    (tmp_path / "only_data" / "__init__.py").write_text("TACTBENCH_API = 2\n")
    write_metadata(tmp_path, "only-data", "1", points="only = only_data")
    monkeypatch.syspath_prepend(tmp_path)
    assert {"pad", "broken", "eflesh-normal"} <= set(datasets())
    assert dataset_called("pad").source.citation == "nobody"
    (row,) = [one for one in load_registry().plugins if one.distribution == "only-data"]
    assert (row.status, row.reason) == ("loaded", "")
    with pytest.raises(ConfigError):
        _ = dataset_called("broken").source
    with pytest.raises(UnknownNameError):
        dataset_called("eflesh-norm")


def test_one_that_cannot_be_had_costs_its_own_rows_of_a_task_that_both_declare(tmp_path, server):
    thirds = {"streams__taxels__annotations": {"third": {"rows_per": 7}}}
    task = {"name": "third", "target": {"source": "label", "name": "third"}, "splits": ["recording"]}
    for name, address in (("pad", server.address), ("lost", "")):
        described(tmp_path, address, name, tasks=[task], source__tasks=["third"], **thirds)
    asked = "run --dataset pad.yaml --dataset lost.yaml --task third --estimator logistic --format json"
    rows = json.loads(Verbs(tmp_path, here=True)(*asked.split()).stdout)
    assert {(row["sensor"], row["status"]) for row in rows} == {("pad", "done"), ("lost", "skipped")}


def test_the_board_asks_data_sets_that_there_are():
    named = {choice.dataset for choice in matrix_called("real").tasks}
    assert len(named) == 8
    assert named <= datasets().keys()


def test_the_list_names_what_cannot_be_fetched(tmp_path):
    lines = Verbs(tmp_path)("datasets").stdout.splitlines()
    assert [line.split()[0] for line in lines if "--root" in line] == ["eflesh-slip"]


def test_the_shipped_ones_are_those_of_the_copies(shared_data):
    assert len(datasets()) >= 6
    for name, one in datasets().items():
        first = next(iter(one.source.files))
        (root,) = (place for place in shared_data.iterdir() if (place / first).is_file())
        contents = {path: (root / path).read_bytes() for path in one.source.files}
        assert one.source.files == digests(contents), name
        assert one.source.bytes == sum(map(len, contents.values())), name
