"""A simulated rig whose skin is a spring, and the example's rig file changed here and there."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np
import yaml

from tactbench.plugin import Block, ChannelSpec, ForceRamp, Scene, StreamSpec, assumed, load_registry
from tactbench.plugin.devices import RigFile, ScenePhysics
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.settings import JOINTS

EXAMPLE = Path(__file__).parents[3] / "examples" / "rigs" / "emulated.yaml"
RATE_HZ = 1000.0


class Spring:
    """Presses a spring; the sensor stays at rest."""

    streams = ()
    reference = (
        StreamSpec(
            name="force_torque", rate_hz=RATE_HZ, channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),)
        ),
    )
    plan = ()

    def __init__(self, scene, stiffness_n_m, noise_n, seed):
        self.assumptions, self.drawn = {}, {}
        self._scene, self._stiffness, self._noise, self._seed = scene, stiffness_n_m, noise_n, seed

    def __iter__(self):
        t_s = np.arange(round(self._scene.profile.duration.to("s") * RATE_HZ)) / RATE_HZ
        noise = self._noise * np.random.default_rng(self._seed).standard_normal(t_s.size)
        force = np.interp(t_s, *self._scene.profile.corners) + noise
        yield Block("force_torque", np.round(1e9 * t_s).astype(np.int64), force[:, None])

    def press_curve(self, largest_n):
        force = np.linspace(0, largest_n, 50)
        return force / self._stiffness, force


class SpringRig:
    """A simulated rig with one spring [N/mm]."""

    def __init__(self, stiffness_n_mm, noise_n=0.005):
        self._stiffness, self._noise = 1e3 * stiffness_n_mm, noise_n

    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield Spring(scene, self._stiffness, self._noise, seed)


def example(**changes):
    """Return the example's data with a rather quiet force sensor, changed by paths like `settings__touch__mean_n`."""
    said = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    quiet = {
        "force__zero_s": 0.3,
        "force__options__rate_hz": 1000.0,
        "settings__limits__travel_ceiling_n": 0.2,
        "settings__limits__force_age_ms": 13.0,
        "settings__limits__heartbeat_ms": 60.0,
        "settings__heights__clearance_mm": 10.0,
        "settings__press__stale_ms": 100.0,
        "settings__limits__force_ceiling_n": 8.0,
        "settings__touch__single_n": 0.1,
        "settings__touch__mean_n": 0.1,
        "settings__touch__mean_ms": 20.0,
        "settings__touch__contact_n": 0.05,
        "settings__touch__settle_s": 0.5,
        "settings__touch__lift_mm": 0.3,
        "settings__press__error_band_n": 1.0,
        "settings__force_loop__feed_forward_n_mm": None,
        "settings__force_loop__proportional_mm_n": 0.0,
        "settings__force_loop__integral_mm_n_s": 0.5,
        "settings__force_loop__cutoff_hz": 2.0,
        "settings__manipulator": "fixed",
        "settings__heights__surface_mm": 0.0,
        "settings__stiffness__softest_n_mm": 2.0,
        "settings__places": {},
        **{f"devices__{name}": ... for name in JOINTS},
    }
    for path, value in (quiet | changes).items():
        *parents, last = path.split("__")
        at = said
        for name in parents:
            at = at.setdefault(name, {})
        if value is ...:
            del at[last]
        else:
            at[last] = value
    return said


def with_joints(**changes):
    """Return the example with its joints: a linear delta whose platform is homed at (0, 0, -150) mm."""
    own = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    kept = {"settings__manipulator": own["settings"]["manipulator"], "settings__heights__surface_mm": -152.0}
    for name in JOINTS:
        own["devices"][name]["options"] = own["devices"][name]["options"] | {"speed_m_s": 7e-3}
    return example(**{f"devices__{name}": own["devices"][name] for name in JOINTS}, **(kept | changes))


def file_of(**changes):
    """Return the example as a rig file."""
    return RigFile.model_validate(example(**changes))


def ramp(end_n=5.0, hold_s=0.5, duration_s=4.0):
    """Return a scene that presses."""
    return Scene(
        name="press",
        profile=ForceRamp(
            end=assumed(end_n, "N", "a test"), hold=assumed(hold_s, "s", "a test"),
            duration=assumed(duration_s, "s", "a test"), samples=100,
        ),
    )  # fmt: skip


class Pressed:
    """What came of one scene."""

    def __init__(self, acquisition):
        blocks = {}
        for block in acquisition:
            blocks.setdefault(block.stream, []).append(block)
        self.acquisition = acquisition
        self.t_s = {name: self._seconds(own) for name, own in blocks.items()}
        self.data = {name: np.concatenate([block.data for block in own]) for name, own in blocks.items()}

    def _seconds(self, blocks):
        return 1e-9 * (np.concatenate([block.t_ns for block in blocks]) - self.acquisition.begin_ns)

    @property
    def force_n(self):
        return self.data["force_torque"][:, 2]

    @property
    def press(self):
        return self.acquisition.control.press


def pressed(rig, scene, seed=1):
    """Carry a scene out with the iCub's emulator."""
    with rig.open(load_registry().sensors["icub"], scene, seed=seed) as acquisition:
        return Pressed(acquisition)


def on_spring(stiffness_n_mm, scene=None, *, noise_n=0.005, seed=1, **changes):
    """Press a spring by the changed example."""
    rig = ParallelManipulator(file_of(**changes), None, ScenePhysics(SpringRig(stiffness_n_mm, noise_n)))
    return pressed(rig, scene or ramp(), seed)
