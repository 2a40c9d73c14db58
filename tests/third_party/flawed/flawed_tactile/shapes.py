"""Shapes of indenters and force profiles with one flaw each."""

import numpy as np

from tactbench.plugin import ForcePath, IndenterDescriptor, Parameter, ProfileDescriptor, Source, hookimpl

TACTBENCH_API = 2
SIZE = Parameter(default=20.0, unit="mm", least=1.0, text="radius of curvature at its tip")
PEAK = Parameter(default=2.0, unit="N", text="the largest force")
SHAPES = (
    "of-one-row", "with-a-hole", "that-stands-off", "that-trembles", "that-cannot-be-small", "deaf-to-its-size",
    "too-sharp",
)  # fmt: skip
_RNG = np.random.default_rng(1)


def sound(x_mm, y_mm, *, size):
    return (x_mm**2 + y_mm**2) / (2 * size)


def of_one_row(x_mm, y_mm, *, size):
    return x_mm**2 / (2 * size)


def with_a_hole(x_mm, y_mm, *, size):
    height = sound(x_mm, y_mm, size=size)
    return np.where(height < 5, height, np.inf)


def that_stands_off(x_mm, y_mm, *, size):
    return sound(x_mm, y_mm, size=size) + 0.1


def that_trembles(x_mm, y_mm, *, size):
    return sound(x_mm, y_mm, size=size * (1 + 0.01 * _RNG.random()))


def that_cannot_be_small(x_mm, y_mm, *, size):
    return sound(x_mm, y_mm, size=size) if size > 1.5 else np.full((x_mm + y_mm).shape, np.nan)


def deaf_to_its_size(x_mm, y_mm, *, size):
    return sound(x_mm, y_mm, size=20.0)


def too_sharp(x_mm, y_mm, *, size):
    return 60.0 / size * np.hypot(x_mm, y_mm)


def push(*, peak):
    return ForcePath(times_s=(0, 1, 2), forces_n=(0, 0, peak), samples=20, source=Source(tag="assumed", reference="t"))


def pull(*, peak):
    return push(peak=peak).model_copy(update={"forces_n": (0.0, 0.0, -peak)})


def under_load(*, peak):
    return push(peak=peak).model_copy(update={"forces_n": (0.1, 0.1, peak)})


def in_grams(*, peak):
    return push(peak=101.97 * peak)


def of_few_samples(*, peak):
    return push(peak=peak).model_copy(update={"samples": 2})


@hookimpl
def tactbench_indenters():
    def shape(name, code, size=SIZE):
        where = f"flawed_tactile.shapes:{code.replace('-', '_')}"
        return IndenterDescriptor(name=name, title="A shape", where=where, dimensions={"size": size})

    return [
        shape("sound-shape", "sound"),
        shape("shape-of-few-words", "sound", SIZE.model_copy(update={"text": "size"})),
        *(shape(f"shape-{flaw}", flaw) for flaw in SHAPES),
    ]


@hookimpl
def tactbench_profiles():
    return [
        ProfileDescriptor(name=name, title="A push", where=f"flawed_tactile.shapes:{code}", parameters={"peak": PEAK})
        for name, code in (
            ("sound-profile", "push"), ("profile-that-pulls", "pull"), ("profile-under-load", "under_load"),
            ("profile-in-grams", "in_grams"), ("profile-of-few-samples", "of_few_samples"),
        )
    ]  # fmt: skip
