"""``tactbench sensitivity``: ordinary runs into folders of their own, found finished the second time."""

from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed
from tactbench.core.study.study import Study, _singles, matrix_of
from tests.conftest import Verbs

ASKED = ("sensitivity", "--sensor", "ideal", "--sensor", "icub", "--task", "force", "--estimator", "ols", "--repeats",
         "1", "--set", "rung=closed-form", "--out", "out", "--format", "md")  # fmt: skip
NUISANCES = ("--nuisance", "placement_tilt_scatter_deg", "--nuisance", "taxel_wander_count")


def test_every_end_is_a_result_folder_and_is_computed_once(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    first = verbs(*ASKED, *NUISANCES)
    assert "stated" in first.stdout
    folders = {path.name: path for path in (tmp_path / "out" / "assumptions").iterdir()}
    alone = {name for name in folders if "," not in name}
    assert alone == {"placement_tilt_scatter_deg=upper", "taxel_wander_count=lower"}, "none at the value as stated"
    values = {name: {row["sensor"]: row["simulation"]["nuisances"] for row in Store(folders[name]).rows()}
              for name in alone}  # fmt: skip
    assert values["taxel_wander_count=lower"] == {"icub": {"taxel_wander_count": 0.0}}, "the other has no such nuisance"
    assert set(values["placement_tilt_scatter_deg=upper"]) == {"ideal", "icub"}
    again = verbs(*ASKED, *NUISANCES)
    assert again.stdout == first.stdout
    assert "recording" not in again.stderr
    assert "icub" in verbs("leaderboard", str(folders["taxel_wander_count=lower"])).stdout


def test_what_cannot_be_set_is_refused(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    assert "placement_scatter_mm" in verbs(*ASKED, "--nuisance", "placement_scater_mm", code=2).stderr


def test_what_the_scenes_of_a_task_differ_in_is_no_assumption():
    ends = {task: _singles(matrix_of(Study(sensor="icub", task=task), installed()), installed(), ())
            for task in ("curvature", "contact-location")}  # fmt: skip
    assert ("placement_x_mm", "upper") in ends["curvature"]
    assert {nuisance for nuisance, _ in ends["curvature"]} - {nuisance for nuisance, _ in ends["contact-location"]} == {
        "placement_x_mm"
    }
