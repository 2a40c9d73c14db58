"""The figure of few sessions: all curves of a folder in one, nothing where there is none."""

from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.figures.few_shot import draw_few_shot
from tactbench.core.report.results import Results


def row(sensor, shots, score, task="force"):
    return {
        "sensor": sensor, "task": task, "estimator": "ols", "params": {}, "protocol": "deployable", "rig": "twin",
        "split": f"few-shot-{shots}", "status": "done", "score": score, "ci_low": score - 0.1, "ci_high": score + 0.1,
        "metric": "rmse", "unit": "N", "simulated": True, "baseline": 1.6, "repeat": 1,
        "is_baseline": False, "key": f"{sensor}-{task}-{shots}",
    }  # fmt: skip


def drawn(folder, rows):
    return draw_few_shot(Results(Store(folder / "results"), load_registry(), tuple(rows)), folder)


def test_every_few_shot_cell_is_in_the_one_figure(tmp_path):
    rows = [row(sensor, n, 1.0 / n, task) for sensor in "ab" for n in (1, 2, 5) for task in ("force", "curvature")]
    (one,) = drawn(tmp_path, rows)
    assert set(one.keys) == {line["key"] for line in rows}
    assert one.png.read_bytes().startswith(b"\x89PNG")
    assert one.pdf.read_bytes().startswith(b"%PDF")
    assert "SIM" in one.caption


def test_trivial_answers_are_a_dotted_line_and_no_curve(tmp_path):
    trivial = [{**row("a", n, 1.6), "is_baseline": True} for n in (1, 2)]
    assert drawn(tmp_path, trivial) == []


def test_one_number_of_sessions_is_no_curve(tmp_path):
    assert drawn(tmp_path, [row("a", 1, 0.9)]) == []
    assert drawn(tmp_path, []) == []


def test_the_figure_is_the_same_every_time(tmp_path):
    rows = [row("a", n, 1.0 / n) for n in (1, 2)]
    (first,) = drawn(tmp_path, rows)
    before = first.png.read_bytes(), first.pdf.read_bytes()
    (again,) = drawn(tmp_path, rows)
    assert (again.png.read_bytes(), again.pdf.read_bytes()) == before
