"""What ``calibration.yaml`` says: which nuisances are drawn from which priors, and what is read off each draw."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from tactbench.core.errors import nearest
from tactbench.core.spec.matrix import EstimatorChoice
from tactbench.core.spec.quantity import Frozen, Source, Tag
from tactbench.core.spec.scene import NUISANCES, Simulation
from tactbench.core.spec.units import with_unit

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]


def _known(name: str) -> str:
    if name not in NUISANCES:
        close = nearest(name, NUISANCES)
        meant = f" (did you mean {close[0]!r}?)" if close else ""
        raise ValueError(f"no nuisance of a scene is called {name!r}{meant}; known: {', '.join(NUISANCES)}")
    return name


SceneNuisance = Annotated[str, AfterValidator(_known)]
"""The name of a nuisance of a scene."""


class Uniform(Frozen):
    """Every value between two bounds is as likely as any other."""

    kind: Literal["uniform"]
    low: float
    high: float

    @model_validator(mode="after")
    def _is_a_range(self) -> Uniform:
        if not self.low < self.high:
            raise ValueError(f"a range needs low < high, not {self.low:g} and {self.high:g}")
        return self


class LogUniform(Frozen):
    """Every factor between two bounds is as likely as any other: for scales nobody knows the decade of."""

    kind: Literal["log-uniform"]
    low: float = Field(gt=0)
    high: float = Field(gt=0)

    @model_validator(mode="after")
    def _is_a_range(self) -> LogUniform:
        if not self.low < self.high:
            raise ValueError(f"a range needs low < high, not {self.low:g} and {self.high:g}")
        return self


class Fixed(Frozen):
    """One value in every draw: what the seed alone does is then seen."""

    kind: Literal["fixed"]
    value: float


Prior = Annotated[Uniform | LogUniform | Fixed, Field(discriminator="kind")]


class Nuisance(Frozen):
    """One number of the scene that no source states well enough."""

    name: Name
    """That of the number it sets, or one of its own where several nuisances set the same one for other sensors."""
    sets: SceneNuisance = ""
    """Which nuisance of a scene it sets (:data:`tactbench.core.spec.scene.NUISANCES`); default: the one of its name."""
    sensors: tuple[str, ...] = ()
    """Whose scenes get it; empty: those of all sensors get the same value."""
    prior: Prior
    """In the unit of what it sets."""
    reason: str
    """Why this range."""
    source: Tag

    @model_validator(mode="before")
    @classmethod
    def _sets_what_it_is_called(cls, given: Any) -> Any:
        if isinstance(given, dict) and "name" in given and not given.get("sets"):
            return {**given, "sets": given["name"]}
        return given

    @property
    def unit(self) -> str:
        """Unit of the prior's numbers."""
        return NUISANCES[self.sets][1]

    @property
    def stream(self) -> str:
        """What its random numbers are drawn by: the name without a unit, so that another unit draws the same."""
        return self.name.removesuffix(with_unit("", self.unit))


class Score(Frozen):
    """The task's own metric."""

    kind: Literal["score"] = "score"


class Band(Frozen):
    """The task's metric over test rows whose commanded force lies in a band."""

    kind: Literal["band"]
    low_n: float = Field(ge=0)
    """Lower end [N], included."""
    high_n: float
    """Upper end [N], not included."""

    @model_validator(mode="after")
    def _is_a_band(self) -> Band:
        if not self.low_n < self.high_n:
            raise ValueError(f"a band needs low_n < high_n, not {self.low_n:g} and {self.high_n:g}")
        return self


class Roughness(Frozen):
    """White noise of the predictions: root mean square of second differences at a lag, over the square root of six."""

    kind: Literal["roughness"]
    lag: int = Field(ge=1)
    """Rows between the differences; longer than the estimator's window, so that no row is in two of its means."""


class Output(Frozen):
    """One number read off each draw."""

    name: Name
    title: str
    """For people: ``BioTac, force RMSE``."""
    sensor: str
    task: str
    estimator: EstimatorChoice
    every: int = Field(default=1, ge=1)
    """Every so-manieth row of the recordings is given to the estimator."""
    figure: Annotated[Score | Band | Roughness, Field(discriminator="kind")] = Score()
    unit: str = "1"
    only_first: int | None = Field(default=None, ge=0)
    """Read off draws below this number only; None: off all."""
    stands_for: Name | None = None
    """The output that this dearer one checks."""


class PublishedNumber(Frozen):
    """A number somebody has published, and what the procedure does with it."""

    output: Name
    value: float
    scale: float = Field(gt=0)
    """A difference of this size is one unit of distance."""
    scale_reason: str
    use: Literal["fitted", "held out"]
    source: Source


class Comparison(Frozen):
    """``above`` exceeds ``below`` by more than ``margin``; a negative margin: falls short of it by less than that."""

    above: Name
    below: Name
    margin: float = 0.0


class Finding(Frozen):
    """A sentence of the publication as a predicate over a draw: true if all of its comparisons are."""

    name: Name
    statement: str
    all_of: tuple[Comparison, ...] = Field(min_length=1)
    reason: str
    """Why these outputs and margins say what the sentence says."""
    source: Source


class Given(Frozen):
    """One number of the scene, as a setting has it."""

    name: SceneNuisance
    """Which nuisance of a scene."""
    value: float
    """In the unit of the name."""
    sensors: tuple[str, ...] = ()
    """Whose scenes get it; empty: those of all sensors."""


class Setting(Frozen):
    """What is set otherwise than the scenes state it, nothing drawn."""

    label: str
    """For people: ``1.8 mm towards the tip``."""
    given: tuple[Given, ...] = Field(min_length=1)


class Variation(Frozen):
    """One thing in several settings, all else as the scenes state it: what it alone does to some of the outputs."""

    name: Name
    title: str
    outputs: tuple[Name, ...] = Field(min_length=1)
    seeds: int = Field(ge=1)
    """How many: the same in every setting."""
    settings: tuple[Setting, ...] = Field(min_length=1)
    reason: str
    """Why these settings are looked at."""


class CalibrationSpec(Frozen):
    """The whole procedure."""

    version: Literal[1] = 1
    title: str
    seed: int = Field(default=1, ge=0)
    draws: int = Field(default=200, ge=1)
    rig: str
    protocol: str
    simulation: Simulation = Simulation()
    """How the simulated rig is asked to carry out every scene."""
    nuisances: tuple[Nuisance, ...] = Field(min_length=1)
    outputs: tuple[Output, ...] = Field(min_length=1)
    published: tuple[PublishedNumber, ...] = Field(min_length=1)
    tolerance: float = Field(gt=0)
    """A draw is near if every fitted number lies within this many scales of the published one."""
    at_least: int = Field(default=0, ge=0)
    """Where fewer draws are near, so many nearest ones are accepted instead; how far they reach is told with them."""
    findings: tuple[Finding, ...] = ()
    variations: tuple[Variation, ...] = ()
    """Looked at beside the draws, and no part of them."""

    @model_validator(mode="after")
    def _names_fit_together(self) -> CalibrationSpec:
        for what, named in (
            ("nuisance", self.nuisances), ("output", self.outputs), ("finding", self.findings),
            ("variation", self.variations),
        ):  # fmt: skip
            _once(what, (one.name for one in named))
        _once("published number", (one.output for one in self.published))
        known = [output.name for output in self.outputs]
        compared = (comparison for finding in self.findings for comparison in finding.all_of)
        names = [
            *(one.output for one in self.published),
            *(name for comparison in compared for name in (comparison.above, comparison.below)),
            *(output.stands_for for output in self.outputs if output.stands_for is not None),
            *(name for variation in self.variations for name in variation.outputs),
        ]
        for name in names:
            if name not in known:
                close = nearest(name, known)
                meant = f" (did you mean {close[0]!r}?)" if close else ""
                raise ValueError(f"no output is called {name!r}{meant}")
        if not any(one.use == "fitted" for one in self.published):
            raise ValueError("at least one published number must be fitted")
        return self

    def output(self, name: str) -> Output:
        """Return an output by its name, which is there."""
        return next(output for output in self.outputs if output.name == name)


def _once(what: str, names: Iterable[str]) -> None:
    twice = [name for name, times in Counter(names).items() if times > 1]
    if twice:
        raise ValueError(f"two of one name: {what} {twice[0]!r}")
