"""What the parallel manipulator's kinematics and moves must give, and what they give.

The twelve poses were computed elsewhere twice: in closed form, and by Newton's method with 60 digits on the chains with
both radii apart. A Newton's method in extended precision stands here beside them. Everything is drawn from one seed.

Usage: python benchmarks/manipulator_oracles.py [--quick] [SEED]
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import Source, assumed
from tactbench.rigs.parallel_manipulator.geometry import Delta, LinearDelta, RotaryDelta
from tactbench.rigs.parallel_manipulator.jacobian import joint_motion, links
from tactbench.rigs.parallel_manipulator.kinematics import forward, inverse, mode_of, solve_forward, solve_inverse
from tactbench.rigs.parallel_manipulator.motion_profile import MotionLimits, MotionProfile
from tactbench.rigs.parallel_manipulator.singularity import PostureLimits, measures
from tactbench.rigs.parallel_manipulator.trajectory import line_motion, straight_move
from tactbench.rigs.parallel_manipulator.workspace import PlaceRefusedError, Workspace

FREE = Source(tag="assumed", reference="to compute with")
DRIVES = {"joint_speed_mm_s": 20.0, "joint_acceleration_mm_s2": 60.0}
"""So slow that moves must be stretched."""
LV = LinearDelta(
    title="vertical rails", source=FREE, base_radius_mm=150.0, platform_radius_mm=30.0, link_mm=250.0,
    joint_lowest_mm=-100.0, joint_highest_mm=250.0, **DRIVES,
)  # fmt: skip
LI = LinearDelta(
    title="rails at 60 deg", source=FREE, base_radius_mm=130.0, platform_radius_mm=30.0, link_mm=220.0,
    inclination_deg=60.0, joint_lowest_mm=-190.0, joint_highest_mm=200.0, **DRIVES,
)  # fmt: skip
RD = RotaryDelta(
    title="arms", source=FREE, base_radius_mm=90.0, platform_radius_mm=30.0, link_mm=220.0, arm_mm=100.0,
    joint_lowest_deg=-60.0, joint_highest_deg=100.0, joint_speed_deg_s=12.0, joint_acceleration_deg_s2=36.0,
)  # fmt: skip
MACHINES: dict[str, Delta] = {"LV": LV, "LI": LI, "RD": RD}
MIDDLE_M = {"LV": -0.15, "LI": -0.12, "RD": -0.2}

# Place in mm; joint values in mm or rad; s, sigma_U, sigma_W, largest |u.t|.
POSES: list[tuple[str, tuple[float, ...], tuple[float, ...], tuple[float, ...]]] = [
    ("LV", (0, 0, -150), (69.317121994613,) * 3, (0.8773, 0.587878, 0.831384, 0)),
    ("LV", (40, 0, -150), (86.854385646540, 54.205778566621, 54.205778566621), (0.8168, 0.587878, 0.828229, 0.1386)),
    ("LV", (-30, 55, -120), (72.288845230294, 123.32393086163, 70.639619885388), (0.7626, 0.587877, 0.825822, 0.2200)),
    ("LV", (62.5, -41.25, -180.125), (59.650285423665, -17.587201311406, 28.599313383626),
     (0.6502, 0.587762, 0.800675, 0.2990)),
    ("LI", (0, 0, -120), (64.462630667492,) * 3, (0.9927, 0.736135, 0.978829, 0)),
    ("LI", (50, 20, -140), (71.212594973168, 37.091777163092, 18.440029052610), (0.9584, 0.635157, 0.897311, 0.2423)),
    ("LI", (-45, -60, -100.5), (38.268245408593, 47.771800418441, 118.20450045294),
     (0.8991, 0.676924, 0.766588, 0.3135)),
    ("LI", (10.25, -70.5, -60), (106.02303291624, 51.302048924952, 141.37780511233),
     (0.8471, 0.785097, 0.702353, 0.3205)),
    ("RD", (0, 0, -200), (0.41629824266379,) * 3, (0.9417, 0.843177, 0.888287, 0)),
    ("RD", (50, 30, -210), (0.20760847127400, 0.56653745074042, 0.89346392323723),
     (0.9434, 0.740406, 0.797678, 0.2650)),
    ("RD", (-70, 40, -180), (0.91082725290107, -0.17186477293339, 0.42713275067054),
     (0.8136, 0.762454, 0.665253, 0.3665)),
    ("RD", (20.5, -85.25, -230.75), (0.69962818657656, 1.2866873718759, 0.39699558069409),
     (0.9181, 0.606563, 0.815686, 0.3875)),
]  # fmt: skip

# Distance in mm, duration in s, speed reached in mm/s, for 50 mm/s, 500 mm/s^2, 5000 mm/s^3.
DURATIONS = [(100, 2.2, 50), (5, 0.317480210, 31.498026), (1, 0.185663553, 10.772173), (0.05, 0.068399038, 1.462009)]


@dataclass(frozen=True)
class Row:
    """One thing wanted and found."""

    what: str
    wanted: str
    found: float
    kept: bool


def at_most(what: str, found: float, limit: float) -> Row:
    """Return a row of a number that must not exceed a limit."""
    return Row(what, f"<= {limit:g}", found, bool(found <= limit))


def exactly(what: str, found: float, wanted: float) -> Row:
    """Return a row of a count."""
    return Row(what, f"{wanted:g}", found, found == wanted)


def newton_joints(delta: Delta, p_m: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return (3,) joint values on the chains with both radii apart, in extended precision."""
    one = np.longdouble(1)
    half, root = one / 2, np.sqrt(3 * one) / 2
    found = start.astype(np.longdouble)
    for leg, (x, y) in enumerate([(one, 0 * one), (-half, root), (-half, -root)]):
        e, up = np.array([x, y, 0], dtype=np.longdouble), np.array([0, 0, 1], dtype=np.longdouble)
        base = np.longdouble(delta.base_radius_mm[leg]) / 1000 * e
        end = p_m.astype(np.longdouble) + np.longdouble(delta.platform_radius_mm[leg]) / 1000 * e
        length, q = np.longdouble(delta.link_mm[leg]) / 1000, found[leg]
        for _ in range(60):
            if isinstance(delta, LinearDelta):
                steep = np.longdouble(delta.inclination_deg[leg]) == 90
                d = up if steep else half * e + root * up  # 60 deg
                joint, slope = base + q * d, d
            else:
                arm = np.longdouble(delta.arm_mm[leg]) / 1000
                joint = base + arm * (np.cos(q) * e - np.sin(q) * up)
                slope = -arm * (np.sin(q) * e + np.cos(q) * up)
            link = end - joint
            q = q - (link @ link - length**2) / (-2 * link @ slope)
        found[leg] = q
    return found.astype(np.float64)


def poses(rng: np.random.Generator, _: int) -> list[Row]:
    """Oracle 1: the twelve poses."""
    worst = dict.fromkeys(["joint [mm]", "joint [rad]", "measures", "Newton [m, rad]", "forward [mm]"], 0.0)
    for name, place, joints, wanted in POSES:
        delta, p = MACHINES[name], 1e-3 * np.array(place)
        q = inverse(delta, p)
        rails = isinstance(delta, LinearDelta)
        unit = "joint [mm]" if rails else "joint [rad]"
        worst[unit] = max(worst[unit], float(np.abs(q * (1e3 if rails else 1) - joints).max()))
        found = measures(delta, p, q)
        least = (found.serial.min(), found.parallel, found.constraint, np.sin(found.sideways_rad.max()))
        worst["measures"] = max(worst["measures"], float(np.abs(np.subtract(least, wanted)).max()))
        off = q + (0.02 if rails else 0.1) * rng.uniform(0.5, 1, 3)
        worst["Newton [m, rad]"] = max(worst["Newton [m, rad]"], float(np.abs(newton_joints(delta, p, off) - q).max()))
        worst["forward [mm]"] = max(worst["forward [mm]"], float(1e3 * np.abs(forward(delta, q) - p).max()))
    limits = (1e-11, 1e-13, 1e-4, 1e-15, 1e-12)
    return [at_most(f"twelve poses, {what}", worst[what], limit) for what, limit in zip(worst, limits, strict=True)]


def grid(_: np.random.Generator, side: int) -> list[Row]:
    """Oracle 2: there and back over a grid, in parts of a link's length."""
    rows = []
    for name, delta in MACHINES.items():
        length = float(delta.link_m.max())
        axis = np.linspace(-0.9, 0.9, side) * length
        p = np.stack(np.meshgrid(axis, axis, axis + MIDDLE_M[name], indexing="ij"), axis=-1).reshape(-1, 3)
        p = p[(solve_inverse(delta, p).shortfall_m <= 0).all(axis=1)]
        q = inverse(delta, p)
        found = measures(delta, p, q)
        good = (found.serial.min(axis=1) >= 0.1) & (found.parallel >= 0.1)
        there = back = 0.0
        for mode in (-1, 1):
            chosen = good & (mode_of(delta, p, q) == mode)
            if chosen.any():
                again = forward(delta, q[chosen], mode)
                there = max(there, float(np.abs(again - p[chosen]).max()) / length)
                back = max(back, float((np.abs(inverse(delta, again) - q[chosen]) * delta.gear_m).max()) / length)
        count = int(good.sum())
        rows += [
            at_most(f"{name}, p -> q -> p over {count} places [L]", there, 1e-12),
            at_most(f"{name}, q -> p -> q [L]", back, 1e-12),
        ]
    return rows


def randoms(rng: np.random.Generator, count: int) -> list[Row]:
    """Oracle 3: random places and joint values; numpy raises on everything."""
    rows, bad = [], 0
    back = onwards = 0.0
    reached = closed = 0
    with np.errstate(all="raise"):
        for name, machine in MACHINES.items():
            for branch in (1, -1):
                delta = machine.model_copy(update={"branch": branch})
                L = delta.link_m
                p = rng.standard_normal((count, 3))
                p *= (
                    np.exp(rng.uniform(np.log(1e-3), np.log(16 * L[0]), (count, 1)))
                    / np.linalg.norm(p, axis=1)[:, None]
                )
                solved = solve_inverse(delta, p)
                bad += int((~np.isfinite(solved.q)).sum() + (~np.isfinite(solved.shortfall_m)).sum())
                miss = np.abs(np.linalg.norm(p[:, None] - delta.centre_m(solved.q), axis=2) - L) / L
                ok = solved.shortfall_m <= 0
                reached += int(ok.sum())
                back = max(back, float(miss[ok].max()))
                span = 2 * L[0] if name != "RD" else np.pi
                q = rng.uniform(-span, span, (count, 3))
                n = min(1000, count // 4)
                q[:n] = q[:n, :1]
                q[n : 2 * n, 1] = q[n : 2 * n, 0]
                q[2 * n] = -0.2  # of LI: all carriages in one place
                placed = solve_forward(delta, q)
                bad += int((~np.isfinite(placed.p_m)).sum() + (~np.isfinite(placed.det)).sum())
                bad += int((~np.isfinite(placed.gap_m)).sum())
                meet = (placed.gap_m <= 0) & (placed.in_line == 0)
                closed += int(meet.sum())
                miss = np.abs(np.linalg.norm(placed.p_m[:, None] - delta.centre_m(q), axis=2) - L) / L
                onwards = max(onwards, float(miss[meet].max()))
                found = measures(delta, p[:10_000], solved.q[:10_000])
                for values in (found.serial, found.parallel, found.constraint, found.sideways_rad, found.det):
                    bad += int((~np.isfinite(values)).sum())
    rows.append(exactly(f"numbers that are not finite, {6 * count} places and joint triples each", bad, 0))
    rows.append(at_most(f"links' lengths after the inverse, {reached} legs that reach [L]", back, 2e-14))
    rows.append(at_most(f"links' lengths after the forward solution, {closed} triples that close [L]", onwards, 2e-14))
    return rows


def permitted(workspace: Workspace, middle_m: float, rng: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, 3) permitted places."""
    span = 0.6 * workspace.delta.link_m[0]
    found = np.empty((0, 3))
    while len(found) < count:
        p = rng.uniform(-span, span, (2 * count, 3)) + np.array([0, 0, middle_m])
        found = np.concatenate([found, p[workspace.permits(p)]])
    return found[:count]


def derivatives(rng: np.random.Generator, count: int) -> list[Row]:
    """Oracle 4: the determinant for nothing, and speeds against differences."""
    det = speed = change = 0.0
    for name, delta in MACHINES.items():
        p = permitted(Workspace(delta), MIDDLE_M[name], rng, count)
        q = inverse(delta, p)
        at = links(delta, p, q)
        det = max(det, float(np.abs(solve_forward(delta, q).det - np.linalg.det(at.unit)).max()))
        v = rng.standard_normal((count, 3))
        v /= np.linalg.norm(v, axis=1)[:, None]
        second = joint_motion(delta, p, q, v, np.zeros((count, 3)))[1]
        # Of four and five places, whose errors are some h^4 and rounding/h^2, times 1/s^9 where s is 0.15.
        h = 2e-5 * delta.link_m[0]
        far, near = (inverse(delta, p + n * h * v) - inverse(delta, p - n * h * v) for n in (2, 1))
        left = np.einsum("nij,nj->ni", at.unit, v)
        right = delta.gear_m * at.projection * (8 * near - far) / (12 * h)
        speed = max(speed, float(np.abs(left - right).max()))
        h = 5e-5 * delta.link_m[0]
        far, near = (inverse(delta, p + n * h * v) + inverse(delta, p - n * h * v) for n in (2, 1))
        found = delta.gear_m * (16 * near - far - 30 * q) / (12 * h**2)
        change = max(change, float(delta.link_m[0] * np.abs(found - delta.gear_m * second).max()))
    return [
        at_most("det U from the forward solution", det, 1e-14),
        at_most("U p' - S q', differences", speed, 1e-9),
        at_most("q'' on a line, second differences [1/L]", change, 1e-5),
    ]


def lines(rng: np.random.Generator, count: int) -> list[Row]:
    """Oracle 5: whole straight moves."""
    rows = []
    for name in ("LV", "LI"):
        delta = MACHINES[name]
        ends = permitted(Workspace(delta), MIDDLE_M[name], rng, 2 * count).reshape(count, 2, 3)
        by_ends = turning = missed = needless = 0
        for start, end in ends:
            inner = start + np.linspace(0, 1, 1002)[:, None] * (end - start)
            solved = solve_inverse(delta, inner)
            found = measures(delta, inner, solved.q)
            by_ends += bool(
                (solved.shortfall_m > 1e-12 * delta.link_m).any()
                or (solved.q < delta.joint_range[0] - 1e-12).any()
                or found.serial.min() < 0.15 - 1e-12
                or found.sideways_rad.max() > math.radians(30) + 1e-12
            )
            # A limit above the ends and below the highest carriage between them, and one above both.
            ending, highest = float(solved.q[[0, -1]].max()), float(solved.q.max())
            turns = highest > ending + 1e-6
            turning += turns
            for limit, good in ((0.5 * (ending + highest), not turns), (highest + 1e-6, True)):
                work = Workspace(delta.model_copy(update={"joint_highest_mm": (1e3 * limit,) * 3}))
                try:
                    work.check_move(start, end)
                    missed += not good
                except PlaceRefusedError:
                    needless += good and not (limit < highest + 1e-6)
        rows += [
            exactly(f"{name}, {count} lines with good ends: reach, s, lower limit or angle lost inside", by_ends, 0),
            exactly(f"{name}, {turning} lines with a carriage above its limit only inside: accepted", missed, 0),
            exactly(f"{name}, {count} lines with the limit above it: refused", needless, 0),
        ]
    wide = RD.model_copy(update={"joint_lowest_deg": (-179.0,) * 3, "joint_highest_deg": (179.0,) * 3})
    work = Workspace(wide, PostureLimits(**{k: assumed(0.01, "1", "") for k in ("serial", "parallel", "constraint")},
                                         sideways=assumed(89.0, "deg", "")))  # fmt: skip
    counter = refused = wrong = 0
    # Beside the shafts, the places too near to one of them lie between others.
    ends = rng.uniform([-0.2, -0.2, -0.14], [0.2, 0.2, -0.08], (400 * count, 3))
    ends = ends[work.permits(ends)]
    ends = ends[: 4 * count].reshape(-1, 2, 3)
    for start, end in ends:
        inner = start + np.linspace(0, 1, 201)[:, None] * (end - start)
        if (solve_inverse(wide, inner).shortfall_m <= 0).all():
            continue
        counter += 1
        try:
            work.check_move(start, end)
            wrong += 1
        except PlaceRefusedError:
            refused += 1
    rows.append(Row(f"RD, of {len(ends)} lines with good ends: out of reach inside", ">= 1", counter, counter >= 1))
    rows.append(exactly("RD, of these accepted", wrong, 0))
    accepted = low_margin = 0.0
    work = Workspace(RD)
    for start, end in permitted(work, MIDDLE_M["RD"], rng, 2 * count).reshape(count, 2, 3):
        try:
            work.check_move(start, end)
        except PlaceRefusedError:
            continue
        accepted += 1
        inner = start + rng.uniform(0, 1, (300, 1)) * (end - start)
        found = measures(RD, inner, inverse(RD, inner))
        low_margin = max(
            low_margin, float(0.15 - min(found.serial.min(), found.parallel.min(), found.constraint.min()))
        )
    rows.append(at_most(f"RD, {accepted:.0f} accepted lines: a measure below its limit by", max(low_margin, 0.0), 1e-3))
    return rows


def refusals(_: np.random.Generator, __: int) -> list[Row]:
    """Oracle 6: a way through sigma_U = 0.15."""
    work, top, inside, deeper = Workspace(LI), [0.0, 0.0, -0.12], [0.0, 0.0, -0.365], [0.0, 0.0, -0.37]

    def tried(start: list[float], end: list[float]) -> PlaceRefusedError | None:
        try:
            work.check_move(np.array(start), np.array(end))
        except PlaceRefusedError as refused:
            return refused
        return None

    error = tried(top, inside)
    named = error is not None and error.measure == "sigma_U"
    place = np.array(error.place_m if error else (0.0, 0.0, -0.12))
    there = float(measures(LI, place, inverse(LI, place)).parallel)
    lowest = float(measures(LI, np.array(inside), inverse(LI, np.array(inside))).parallel)
    worst = error.value if error is not None and error.value is not None else math.inf
    return [
        exactly("into the forbidden band: refused for sigma_U", float(named), 1),
        at_most("its first place: sigma_U there - 0.15", abs(there - 0.15), 1e-8),
        at_most("its value: the least sigma_U of the way", abs(worst - lowest), 1e-12),
        exactly("out of the band: accepted", float(tried(inside, top) is None), 1),
        exactly("deeper into it: refused", float(tried(inside, deeper) is not None), 1),
        exactly(
            "inside it, to its edge: accepted",
            float(tried(inside, [*place[:2].tolist(), float(place[2]) + 1e-6]) is None),
            1,
        ),
    ]


def moves(rng: np.random.Generator, count: int) -> list[Row]:
    """Oracle 7: durations, and joint limits at random times of random moves."""
    worst = max(abs(MotionProfile(1e-3 * d, 0.05, 0.5, 5.0).duration_s - t) for d, t, _ in DURATIONS)
    peak = max(abs(1e3 * MotionProfile(1e-3 * d, 0.05, 0.5, 5.0).peak_m_s - v) for d, _, v in DURATIONS)
    speed = change = sent = 0.0
    shorter = stretched = 0
    factors = []
    for name, delta in MACHINES.items():
        work = Workspace(delta)
        share = -(-count // 3)
        for start, end in permitted(work, MIDDLE_M[name], rng, 2 * share).reshape(share, 2, 3):
            try:
                found = straight_move(work, start, end, MotionLimits(), 100.0)
            except PlaceRefusedError:
                continue
            plain = MotionProfile.of(float(np.linalg.norm(end - start)), MotionLimits())
            shorter += found.duration_s < plain.duration_s
            stretched += found.profile.stretch > 1
            factors.append(found.profile.stretch)
            times = np.sort(rng.uniform(0, found.duration_s, 2000))
            _, _, rate, second = line_motion(delta, start, end, found.profile, times)
            speed = max(speed, float((np.abs(rate) / delta.joint_speed).max()))
            change = max(change, float((np.abs(second) / delta.joint_acceleration).max()))
            sent = max(sent, float((np.abs(np.diff(found.q, axis=0)) * 100 / delta.joint_speed).max()))
    return [
        at_most("S-curve durations [s]", worst, 1e-8),
        at_most("S-curve speeds reached [mm/s]", peak, 1e-6),
        at_most(f"{len(factors)} moves, joint speed / limit", speed, 1.0),
        at_most("joint acceleration / limit", change, 1.0),
        at_most("targets sent at 100 Hz, speed / limit", sent, 1.0),
        exactly("moves shorter than without joint limits", shorter, 0),
        Row(f"moves slowed: {stretched}; mean factor", "> 1", float(np.mean(factors)), float(np.mean(factors)) > 1),
    ]


ORACLES: list[tuple[Callable[[np.random.Generator, int], list[Row]], int, int]] = [
    (poses, 0, 0),
    (grid, 61, 13),
    (randoms, 1_000_000, 4_000),
    (derivatives, 10_000, 300),
    (lines, 1000, 30),
    (refusals, 0, 0),
    (moves, 1000, 30),
]
"""Each with its size, and a small one for tests."""


def main(quick: bool, seed: int) -> int:
    """Print the table; return how many rows are not kept."""
    print("| oracle | what | wanted | found | kept |\n|---|---|---|---|---|")
    lost = 0
    for number, (oracle, size, small) in enumerate(ORACLES, start=1):
        started = time.perf_counter()
        rows = oracle(np.random.default_rng([seed, number]), small if quick else size)
        for row in rows:
            lost += not row.kept
            print(f"| {number} | {row.what} | {row.wanted} | {row.found:.6g} | {'yes' if row.kept else 'NO'} |")
        print(f"oracle {number}: {time.perf_counter() - started:.1f} s", file=sys.stderr)
    return lost


if __name__ == "__main__":
    arguments = [argument for argument in sys.argv[1:] if argument != "--quick"]
    raise SystemExit(min(1, main("--quick" in sys.argv, int(arguments[0]) if arguments else 1)))
