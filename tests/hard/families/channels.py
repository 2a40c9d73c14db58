"""Hard recordings: whole scenes through the twin, with numbers from the ends of what a scene can say."""

import math
from functools import cache

import numpy as np

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import (
    ForceRamp,
    Indenter,
    Placement,
    Quality,
    RigContext,
    Scene,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.rig import REFERENCE_STREAM, build

_CAPS_MM = (5.0, 10.0, 40.0)


def _q(value, unit):
    return assumed(value, unit, "a hard case")


@cache
def _twin():
    effects = load_registry().effects
    return build(RigContext(effects=tuple(effects[name] for name in effects.names())))


def _sensor(case):
    sensors = load_registry().sensors
    able = [name for name in sensors.names() if sensors[name].spec.skin is not None and sensors[name].transducer]
    name = case.one_of(*able)
    case.says(sensor=name)
    return sensors[name]


def _scene(case, **changed):
    """Return an ordinary scene in a few rows, of a contact that many cases share, with some things changed."""
    ordinary: dict[str, object] = {
        "name": "hard",
        "indenter": Indenter(radius=_q(float(case.rng.choice(_CAPS_MM)), "mm")),
        "placement": Placement(scatter=_q(0.0, "mm")),
        "profile": ForceRamp(samples=int(case.rng.integers(1, 50))),
    }
    return Scene.model_validate({**ordinary, **changed})


def _recorded(case, sensor, scene, seed):
    """Carry out a scene and hold what comes out against what every recording promises."""
    with _twin().open(sensor, scene, seed=seed) as acquisition:
        blocks = list(acquisition)
    for stream in (*acquisition.streams, *acquisition.reference):
        samples = acquisition.samples[stream.name]
        own = [block for block in blocks if block.stream == stream.name]
        case.holds(sum(len(block.data) for block in own) == len(samples.data), f"blocks of {stream.name} lose rows")
        case.holds(np.isfinite(samples.data.astype(np.float64)).all(), f"{stream.name} holds what is no number")
        case.holds(np.all(np.diff(samples.t_ns) >= 0), f"the clock of {stream.name} runs backwards")
        case.holds(samples.data.dtype == np.dtype(stream.dtype), f"{stream.name} is stored as {samples.data.dtype}")
        for column, channel in enumerate(stream.channels):
            read = np.asarray(samples.data[:, column], dtype=np.float64)
            low = -math.inf if channel.lower is None else channel.lower
            high = math.inf if channel.upper is None else channel.upper
            case.holds(np.all((read >= low) & (read <= high)), f"{channel.name} leaves its converter's range")
            if samples.quality is not None:
                flagged = (samples.quality[:, column] & Quality.SATURATED) != 0
                at_an_end = (read <= low) | (read >= high)
                case.holds(np.array_equal(flagged, at_an_end), f"{channel.name} at its end and not flagged, or flagged")
    case.holds(REFERENCE_STREAM in acquisition.samples, "no reference force")
    return acquisition


def any_environment(case):
    """Record finite readings in the converter's range, flagged where it stood at its end, whatever the nuisances.

    Noise, drift and offsets from none to a million times what the spec states; a second to a century since power-on.
    """
    sensor = _sensor(case)
    names = ("noise_scale", "drift_scale", "session_offset_scale")
    scales = {name: 0.0 if case.chance(0.3) else case.decades(1e-3, 1e6) for name in names}
    environment = Environment(
        since_power_on=_q(0.0 if case.chance(0.2) else case.decades(1.0, 3e9), "s"),
        force_noise=_q(0.0 if case.chance(0.3) else case.decades(1e-6, 1e3), "N"),
        **scales,
    )
    case.says(**scales)
    _recorded(case, sensor, _scene(case, environment=environment), int(case.rng.integers(-(2**31), 2**31)))


def any_profile(case):
    """Record ramps of any length: one row, all rest, up, down, level, a millisecond, eleven days; or nothing at all.

    Times ascend or repeat, the force follows the ramp, and zero force reads the same as rest.
    """
    sensor = _sensor(case)
    start, end = ((0.0, 5.0), (5.0, 0.0), (5.0, 5.0), (0.0, 0.0), (1e-12, 1e-12))[case.rng.integers(5)]
    duration = case.decades(1e-3, 1e6)
    hold = (0.0, duration * case.uniform(0, 1), duration, 2 * duration)[case.rng.integers(4)]
    quiet = Environment(noise_scale=0.0, drift_scale=0.0, force_noise=_q(0.0, "N"))
    profile = ForceRamp(
        start=_q(start, "N"), end=_q(end, "N"), hold=_q(hold, "s"), duration=_q(duration, "s"),
        samples=int(case.rng.integers(1, 50)),
    )  # fmt: skip
    case.says(start_n=start, end_n=end, duration_s=duration, hold_s=hold, samples=profile.samples)
    acquisition = _recorded(case, sensor, _scene(case, profile=profile, environment=quiet), 1)
    force = np.asarray(acquisition.samples[REFERENCE_STREAM].data[:, 0], dtype=np.float64)
    low, high = min(start, end), max(start, end)
    case.holds(np.all((force >= low) & (force <= high)), "the force leaves its ramp")
    case.holds(force[0] == start, "the force does not start where it should")


def any_force(case):
    """Record up to 500 N in range, with a remark beyond 5 N, or refuse a cap pressed past its rim."""
    sensor = _sensor(case)
    largest = float(case.rng.choice([20.0, 50.0, 500.0]))
    case.says(largest_n=largest)
    case.right = "either"
    acquisition = _recorded(case, sensor, _scene(case, profile=ForceRamp(end=_q(largest, "N"), samples=20)), 1)
    case.holds("remark load" in acquisition.drawn, f"{largest:g} N and no remark")


def same_seed_same_bits(case):
    """Give the same bits for the same seed, negative seeds and those beyond 64 bits included."""
    sensor, seed = _sensor(case), int(case.rng.integers(-(2**62), 2**62)) * int(case.rng.choice([1, 2**40]))
    scene = _scene(case, profile=ForceRamp(samples=30))
    first, second = (_recorded(case, sensor, scene, seed) for _ in range(2))
    for name, samples in first.samples.items():
        case.holds(np.array_equal(samples.data, second.samples[name].data), f"{name} differs with the same seed")


def any_rung(case):
    """Record on any rung of the ladder and to any tolerance, or refuse: a rung wrong for a skin, a bound none keeps."""
    sensor = _sensor(case)
    asked: dict[str, object] = {"rung": case.one_of("closed-form", "default", "fine", "no such rung")}
    if case.chance(0.2):
        asked = {"tolerance": case.decades(1e-6, 1e3)}
    largest = case.decades(1e-12, 50.0)
    case.says(largest_n=largest, **{name: str(value) for name, value in asked.items()})
    case.right = "refusal" if "no such rung" in asked.values() else "either"
    simulation = Simulation.model_validate(asked)
    _recorded(case, sensor, _scene(case, simulation=simulation, profile=ForceRamp(end=_q(largest, "N"), samples=9)), 1)


_NUMBERS = (
    "duration", "hold", "start", "end", "radius", "x", "s", "scatter", "tilt_x", "tilt_s", "since_power_on",
    "force_noise", "noise_scale", "drift_scale", "session_offset_scale",
)  # fmt: skip
_UNITS = {"start": "N", "end": "N", "force_noise": "N", "tilt_x": "rad", "tilt_s": "rad", "radius": "mm", "x": "mm"}
_UNITS |= {"s": "mm", "scatter": "mm"}


def impossible_scenes(case):
    """Refuse a scene in which a number is none or infinite, or below zero where there is no such thing."""
    sensor, name = _sensor(case), case.one_of(*_NUMBERS)
    below_zero = name not in ("x", "s", "tilt_x", "tilt_s")
    values = (math.nan, -math.inf, math.inf if name != "radius" else 0.0, -case.decades(1e-3, 1e3))
    value = values[case.rng.integers(4 if below_zero else 3)]
    case.says(quantity=name, value=value)
    quantity = math.inf if name.endswith("_scale") else _q(value, _UNITS.get(name, "s"))
    parts = {"profile": ForceRamp(samples=5), "placement": Placement(), "environment": Environment()}
    case.right = "refusal"
    if name == "radius":
        scene = _scene(case, indenter=Indenter(radius=quantity))
    else:
        part = next(part for part, made in parts.items() if name in type(made).model_fields)
        scene = _scene(case, **{part: parts[part].model_copy(update={name: quantity})})
    _recorded(case, sensor, scene, 1)


FAMILIES = (
    any_environment, any_profile, any_force, any_rung, same_seed_same_bits, impossible_scenes,
)  # fmt: skip
