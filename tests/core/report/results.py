"""A small result folder, made by a real run on the twin, and a small real figure of it."""

import yaml

from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.report.results import SavedFigure
from tactbench.core.spec.matrix import MatrixSpec
from tests.here import IN_THIS_PROCESS

MATRIX = """\
repeats: 1
simulation: {rung: closed-form}  # the cheapest
tasks:
  - name: force
    protocol: karl2016
    estimators: [lasso, {name: forest, params: {n_estimators: 3, max_depth: 6}}]
  - name: curvature
    protocol: karl2016
    estimators: [{name: forest, params: {n_estimators: 3, max_depth: 6}}]
  - name: grasp-stability  # no scene for the twin: its cells are skipped, with a reason
"""


def make_results(folder, *sensors):
    """Run the matrix for these sensors; the results are put into `folder`."""
    matrix = MatrixSpec.model_validate({"sensors": sensors, **yaml.safe_load(MATRIX)})
    run_matrix(matrix, Store(folder), choice=IN_THIS_PROCESS)
    return folder


def draw_one(material, folder):
    """Draw the predictions of the first cell that has any against the truth."""
    from matplotlib.figure import Figure

    answers = next(found["test"] for row in material.rows if (found := material.answers(row)))
    figure = Figure(figsize=(4, 3))
    figure.subplots().plot(answers.y_true, answers.y_pred, ".")
    drawn = SavedFigure(
        "predicted-against-true", "Predicted against true", "Force: truth across, prediction upwards, newtons.",
        folder / "one.png",
    )  # fmt: skip
    figure.savefig(drawn.png)
    return drawn
