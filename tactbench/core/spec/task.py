"""What a task asks of recordings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import ChannelKind


class PlannedScene(Frozen):
    """A scene and what the recording of it is for."""

    scene: Scene
    role: Role
    drawn_order: str = ""
    """Name of a group whose scenes follow each other in an order drawn with the seed; empty: as declared."""


def in_drawn_order(planned: Sequence[PlannedScene], seed: int) -> tuple[PlannedScene, ...]:
    """Return the scenes with those of each group of `drawn_order` in an order drawn with `seed`.

    The members of a group share out their own places in the sequence and their own starting times, so that what the
    scene is of and how warm the sensor is by then are independent. Members are ordered by a hash (BLAKE2) of seed,
    group and name: uniform over all orders, the same everywhere, and the same in every task that has the group.
    """
    found = list(planned)
    groups = dict.fromkeys(item.drawn_order for item in planned if item.drawn_order)
    for group in groups:
        places = [place for place, item in enumerate(planned) if item.drawn_order == group]
        times = sorted(planned[place].scene.starts_after_s for place in places)
        members = sorted((planned[place] for place in places), key=lambda item: _draw(seed, group, item.scene.name))
        for place, start, item in zip(places, times, members, strict=True):
            scene = item.scene.model_copy(update={"starts_after_s": start})
            found[place] = item.model_copy(update={"scene": scene})
    return tuple(found)


def _draw(seed: int, *names: str) -> bytes:
    return hashlib.blake2b("\x1f".join((str(seed), *names)).encode(), digest_size=16).digest()


class ChannelTarget(Frozen):
    """The number to predict is a channel of the reference, sample by sample."""

    source: Literal["channel"] = "channel"
    kind: ChannelKind = "force"
    name: str | None = None
    """Which one, if a recording has several of this kind; None takes the only one or the one called `normal`."""
    unit: str = "N"


class LabelTarget(Frozen):
    """The class to predict is a label: of the whole recording, or of each row (an annotation)."""

    source: Literal["label"] = "label"
    name: str
    unit: str = "1"


class Published(Frozen):
    """A figure somebody has published for this task. It stands beside rows it is comparable with, and no others."""

    score: float
    reference: str
    protocol: str
    """Only rows under this protocol stand beside it."""
    sensor: str | None = None
    """None: of any sensor."""
    estimator: str | None = None
    """None: by a model of their own that is none of ours; `remark` says which."""
    split: str | None = None
    """None: whichever split the protocol has."""
    title: str = ""
    """What it is, in a few words, for a reproduction table."""
    remark: str = ""
    """What must be known to compare with it."""


class TaskSpec(Frozen):
    """A question asked of recordings: pure data, the core carries it out."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    title: str
    question: str
    """One sentence, for people."""
    kind: Literal["regression", "classification"]
    features: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels an estimator may look at."""
    target: ChannelTarget | LabelTarget
    metric: str
    """Name of the primary metric; see docs/glossary.md."""
    unit: str = "1"
    """Unit of the primary metric."""
    equivalence: float | None = Field(default=None, ge=0)
    """Region of practical equivalence, in the metric's unit: two scores that differ by no more are the same to whoever
    uses the sensor. None: nobody has said, and only chance makes scores alike."""
    reference_score: float | None = None
    """What counts as 1 where scores of several tasks are averaged, the trivial baseline being 0; None: the metric's
    perfect answer."""
    scenes: tuple[PlannedScene, ...] = ()
    """What a rig should record; empty: only recordings made elsewhere can answer."""
    campaigns: dict[str, tuple[PlannedScene, ...]] = Field(default_factory=dict)
    """By name of a split: what a rig should record for it instead of `scenes`. Groups that such a split keeps apart are
    left out one by one. Scenes of one name are one scene, in every campaign."""
    protocols: tuple[str, ...]
    """Allowed protocols, the default first."""
    splits: tuple[str, ...] = ()
    """Splits that make sense for `deployable`, the default first: roles, session, in-session, few-shot-N, or a group's
    name."""
    estimators: tuple[str, ...]
    """What answers when nobody asks for another."""
    baselines: tuple[str, ...]
    """Trivial answers that stand in every table and are probed; the best of them is the bar."""
    published: tuple[Published, ...] = ()

    def published_for(self, sensor: str, protocol: str, estimator: str, split: str | None) -> Published | None:
        """Return the published figure that a result may stand beside, or None; the one for this sensor first."""
        fitting = [
            one
            for one in self.published
            if one.protocol == protocol
            and one.sensor in (None, sensor)
            and one.estimator in (None, estimator)
            and (one.split is None or split is None or one.split == split)
        ]
        return min(fitting, key=lambda one: (one.sensor is None, one.estimator is None), default=None)

    def scenes_for(self, split: str | None) -> tuple[PlannedScene, ...]:
        """Return what a rig should record to answer under `split`, as declared; None is the default split."""
        return self.scenes if split is None else self.campaigns.get(split, self.scenes)
