"""Every campaign of every task: scenes that can be told apart, shared where they are equal, and carried out."""

import itertools

import pytest
from threadpoolctl import threadpool_limits

from tactbench.core.evaluation.protocols import shots
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.matrix.plan_recordings import requests_for
from tactbench.core.matrix.store import Store
from tactbench.core.spec.matrix import MatrixSpec, TaskChoice
from tactbench.core.spec.task import in_drawn_order
from tactbench.plugin import ForceRamp

from .made import REGISTRY, twin

TASKS = {task.spec.name: task.spec for task in REGISTRY.tasks}
CAMPAIGNS = [(name, split, task.scenes_for(split)) for name, task in TASKS.items() for split in (None, *task.campaigns)]


@pytest.mark.parametrize(("name", "split", "planned"), CAMPAIGNS, ids=[f"{n}-{s}" for n, s, _ in CAMPAIGNS])
def test_scenes_of_a_campaign_have_names_of_their_own(name, split, planned):
    names = [item.scene.name for item in planned]
    assert len(set(names)) == len(names)
    moments = [(item.scene.session, item.scene.unit, item.scene.starts_after_s) for item in planned]
    assert len(set(moments)) == len(moments), "one sensor is pressed once at a time"
    assert split is None or split in TASKS[name].splits


@pytest.mark.parametrize("name", TASKS)
def test_one_name_is_one_scene_in_all_campaigns_of_a_task(name):
    """Recordings that are replayed are found by the name of their scene."""
    task = TASKS[name]
    by_name = {}
    for item in itertools.chain(task.scenes, *task.campaigns.values()):
        assert by_name.setdefault(item.scene.name, item) == item


def test_campaigns_of_other_tasks_share_their_recordings(tmp_path):
    matrix = MatrixSpec(repeats=1, tasks=tuple(
        TaskChoice(name=name, protocol="deployable", split=("roles", "placement", "unit", "few-shot"))
        for name in ("force", "curvature", "inverse-radius")
    ))  # fmt: skip
    cells = plan_cells(matrix, ["icub"], REGISTRY)
    orders = requests_for(cells, REGISTRY, Keys(REGISTRY), Store(tmp_path))
    paths = {key: {order.path for order in some} for key, some in orders.items()}
    every = set().union(*paths.values())
    for split in ("placement", "unit", "few-shot-1", "few-shot-2", "few-shot-5", "few-shot-10"):
        whole = paths["icub", "inverse-radius", split, 1]
        assert paths["icub", "force", split, 1] < whole
        assert paths["icub", "curvature", split, 1] < whole
    assert paths["icub", "curvature", "roles", 1] < paths["icub", "inverse-radius", "roles", 1]
    # 30 at places, 30 on units, 15 sessions of 6; the paper's 15 caps, 3 flats for force and 3 beside the caps.
    assert len(every) == 30 + 30 + 90 + 15 + 3 + 3


@pytest.mark.parametrize("task", [task for task in TASKS.values() if "few-shot-10" in task.campaigns],
                         ids=lambda task: task.name)  # fmt: skip
def test_few_shots_record_nested_sessions_and_the_same_tests(task):
    found = sorted((shots(split), split) for split in task.campaigns if shots(split))
    assert [number for number, _ in found] == [1, 2, 5, 10]
    before, tested = set(), []
    for number, split in found:
        train = {item.scene.name: item.scene.session for item in task.campaigns[split] if item.role == "train"}
        assert len(set(train.values())) == number
        assert before < train.keys()
        before = train.keys()
        tested.append([item for item in task.campaigns[split] if item.role == "test"])
    assert tested == [tested[0]] * 4
    assert len({item.scene.session for item in tested[0]}) == 5


EXTREMES = [
    *(item.scene for item in TASKS["inverse-radius"].campaigns["placement"]
      if item.scene.labels["cap_radius_mm"] in (5.0, "flat")),
    next(item.scene for item in TASKS["inverse-radius"].campaigns["unit"] if item.scene.unit == "2"),
]  # fmt: skip
"""Every place, pressed by the smallest cap and by flat, and one more unit."""
UNITS = {"remark unit gain", "remark unit rest"}


@pytest.mark.parametrize("sensor", ["biotac", "icub"])
def test_both_sensors_can_carry_out_every_place_and_another_unit(sensor):
    assert len(EXTREMES) == 11
    for scene in EXTREMES:
        short = scene.model_copy(update={"profile": ForceRamp(samples=20)})
        # One thread, as the command line has it: threads that outnumber the cores make small solves slow.
        with threadpool_limits(1), twin().open(REGISTRY.sensors[sensor], short, seed=1) as acquisition:
            blocks = list(acquisition)
            remarks = {name for name in acquisition.drawn if name.startswith("remark ")}
        assert {block.stream for block in blocks} >= {"force_torque"}
        assert all(block.quality is None or not (block.quality & 2).any() for block in blocks), "no channel saturates"
        # A smallest cap is pressed deep, and a flat surface overlaps the soft margin a little: both are said.
        assert remarks - {"remark edge", "remark flank"} == (UNITS if scene.unit != "1" else set()), scene.name


def in_time(task, seed):
    """Names of a task's caps in the order in which they follow each other, session by session."""
    planned = in_drawn_order(TASKS[task].scenes, seed)
    caps = [item.scene for item in planned if item.drawn_order]
    assert caps == sorted(caps, key=lambda scene: scene.starts_after_s)
    return [scene.name for scene in caps]


def test_the_order_of_the_caps_belongs_to_the_seed():
    assert in_time("curvature", 3) == in_time("curvature", 3) == in_time("inverse-radius", 3)
    orders = [in_time("curvature", seed) for seed in range(20)]
    assert len({tuple(order) for order in orders}) == 20
    # Sessions are drawn each by itself.
    caps = [[name.rsplit("-", 1)[0] for name in order] for order in orders]
    assert sum(order[:5] == order[5:10] for order in caps) < 5


def test_what_is_to_be_recorded_holds_the_drawn_order(tmp_path):
    """A recording keeps its scene."""
    choice = TaskChoice(name="curvature", protocol="karl2016")
    cells = plan_cells(MatrixSpec(seed=5, repeats=1, tasks=(choice,)), ["icub"], REGISTRY)
    (orders,) = requests_for(cells, REGISTRY, Keys(REGISTRY), Store(tmp_path)).values()
    assert [order.scene.name for order in orders] == in_time("curvature", 5)
