"""A small result folder, made by the real command line, and a small real figure of it."""

from tactbench.core.report.saved_figure import SavedFigure

MATRIX = """\
repeats: 1
sensors: [icub]
tasks:
  - name: force
    protocol: karl2016
    estimators: [lasso, {name: forest, params: {n_estimators: 3, max_depth: 6}}]
  - name: curvature
    protocol: karl2016
    estimators: [{name: forest, params: {n_estimators: 3, max_depth: 6}}]
  - name: grasp-stability  # no scene for the twin: its cells are skipped, with a reason
"""


def make_results(shell):
    """Run the matrix in the shell's folder; return the result folder."""
    (shell.folder / "matrix.yaml").write_text(MATRIX)
    shell("run", "--config", "matrix.yaml")
    return shell.folder / "tactbench-results"


def draw_one(material, folder, progress=None, remark=print):
    """Draw the predictions of the first cell that has any against the truth."""
    from matplotlib.figure import Figure

    row, answers = next((row, found["test"]) for row in material.rows if (found := material.answers(row)))
    figure = Figure(figsize=(4, 3))
    figure.subplots().plot(answers.y_true, answers.y_pred, ".")
    drawn = SavedFigure(
        "predicted-against-true", "Predicted against true", "Force: truth across, prediction upwards, newtons.",
        folder / "one.png", folder / "one.pdf", (row["key"],),
    )  # fmt: skip
    figure.savefig(drawn.png)
    figure.savefig(drawn.pdf)
    remark("Curvature is not drawn: this is a test.")
    return [drawn]
