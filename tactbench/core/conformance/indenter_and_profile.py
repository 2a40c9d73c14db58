"""Checks of what a scene is given by name and a few numbers: shapes of indenters and force profiles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, check, code_of, fail, skip
from tactbench.core.conformance.press import FORCE_SHARE, pressing_channel
from tactbench.core.conformance.subject import Subject
from tactbench.core.conformance.trial_press import carried_out, simulated_rig, simulated_sensors, tiny_scene
from tactbench.core.errors import PluginContractError, RigError, UsageError
from tactbench.core.plugins.force_profiles import force_path
from tactbench.core.spec.parameter import Parameter
from tactbench.core.spec.profile import ForcePath
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Indenter

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray

REACH_MM = 15.0
"""Half of the side of the plane over which heights are looked at: no skin here is wider."""
LOWEST_MM = 1e-9
"""By which the lowest point may miss 0: rounding of millimetres, and nothing that a skin feels."""
MOST_N = 100.0
"""Beyond the rated range of every tactile sensor of a finger."""
_WHY = "a check of plugins"


def _numbers(subject: Subject) -> Mapping[str, Parameter]:
    found: Mapping[str, Parameter] = (
        subject.descriptor.dimensions if subject.kind == "indenter" else subject.descriptor.parameters
    )
    return found


def _field(subject: Subject) -> str:
    return "dimensions" if subject.kind == "indenter" else "parameters"


def _places() -> tuple[FloatArray, FloatArray]:
    """Return the (61, 1) and (1, 61) places over which a height is asked for; the middle is the origin."""
    import numpy as np

    line = np.linspace(-REACH_MM, REACH_MM, 61)
    return line[:, None], line[None, :]


def _height(subject: Subject, **changed: float) -> Any:
    x_mm, y_mm = _places()
    sizes = {name: one.default for name, one in _numbers(subject).items()} | changed
    with code_of("where", subject.package):
        return subject.code("where")(x_mm, y_mm, **sizes)


def _path(subject: Subject, **changed: float) -> ForcePath:
    given = {name: assumed(value, _numbers(subject)[name].unit, _WHY) for name, value in changed.items()}
    with code_of("where", subject.package):
        made = force_path(subject.descriptor, given, _WHY)
        return ForcePath.model_validate(made.model_dump())


def _answer(subject: Subject, **changed: float) -> Any:
    """Return heights, or times, forces and how many samples, with some numbers changed from their defaults."""
    import numpy as np

    if subject.kind == "indenter":
        return np.asarray(_height(subject, **changed))
    path = _path(subject, **changed)
    return np.array([*path.times_s, *path.forces_n, path.samples])


@check("indenter", "profile")
def numbers_are_described(subject: Subject) -> None:
    """Whoever asks for a shape or a profile by name sees its numbers in `tactbench show`, and nothing else of it.

    Say in the text of every Parameter what the number is: of what, from where to where.
    """
    for name, one in _numbers(subject).items():
        if one.text.strip().lower().replace(" ", "_") in (name, "") or "todo" in one.text.lower():
            fail(f"{_field(subject)}[{name}].text", f"{one.text!r} says nothing")


@check("indenter", needs=("code-names-resolve",))
def height_has_the_shape(subject: Subject) -> None:
    """A height is asked for at all places at once, as two arrays that broadcast: one number each is needed.

    Compute with the arrays x_mm and y_mm, and let both have a part in the shape of what is returned.
    """
    import numpy as np

    found = np.shape(_height(subject))
    if found != (61, 61):
        fail("where", f"for places of shapes (61, 1) and (1, 61) it returned shape {found}, and (61, 61) is needed")


@check("indenter", needs=("height-has-the-shape",))
def height_is_finite(subject: Subject) -> None:
    """The solver subtracts heights and squares them: what is not finite anywhere is a number nowhere.

    Return a large height, 50 mm or more, where a flank is vertical or no body is.
    """
    import numpy as np

    found = np.asarray(_height(subject), dtype=np.float64)
    if not np.all(np.isfinite(found)):
        i, j = np.argwhere(~np.isfinite(found))[0]
        x_mm, y_mm = _places()
        fail("where", f"at ({x_mm[i, 0]:g}, {y_mm[0, j]:g}) mm it returned {found[i, j]}")


@check("indenter", needs=("height-is-finite",))
def lowest_at_the_origin(subject: Subject) -> None:
    """A scene says where the lowest point of the indenter touches, and depths count from there.

    Let the height be 0 at (0, 0) and nowhere below.
    """
    import numpy as np

    found = np.asarray(_height(subject), dtype=np.float64)
    if abs(found[30, 30]) > LOWEST_MM:
        fail("where", f"at (0, 0) it returned {found[30, 30]:g} mm, and 0 is needed")
    if found.min() < -LOWEST_MM:
        fail("where", f"its lowest height is {found.min():g} mm, and none below 0 is possible")


@check("indenter", needs=("lowest-at-the-origin",), level="silver")
def indenter_is_pressed(subject: Subject) -> None:
    """Whether a shape can be pressed into a skin shows when it is: too sharp, and it touches one cell.

    Choose default dimensions that a skin with cells of a third of a millimetre resolves: flanks of up to 45 degrees.
    """
    if not simulated_sensors(subject):
        skip("no sensor that can be simulated is installed")
    rig, of_rig = simulated_rig(subject)
    sizes = {name: assumed(one.default, one.unit, _WHY) for name, one in _numbers(subject).items()}
    scene = tiny_scene(indenter=Indenter(shape=subject.name, dimensions=sizes))
    try:
        carried_out(rig, of_rig, simulated_sensors(subject)[0], scene, 1)
    except (RigError, UsageError, PluginContractError) as error:
        fail("where", str(error))


@check("profile", needs=("code-names-resolve",))
def path_is_made(subject: Subject) -> None:
    """A scene holds the path and not the profile: times that ascend from 0 s, forces that are finite and 0 N or more.

    Return a tactbench.plugin.ForcePath from the default parameters, built by its class and not around its checks.
    """
    _path(subject)


@check("profile", needs=("path-is-made",))
def path_begins_without_load(subject: Subject) -> None:
    """A recording is tared on its own unloaded hold: one that begins under load takes that for zero.

    Begin with a hold at 0 N, by default of some seconds.
    """
    path = _path(subject)
    if path.forces_n[0] != 0:
        fail("where", f"its first force is {path.forces_n[0]:g} N")
    if not path.hold_s > 0:
        fail("where", "it begins to press at once, and no hold is left to tare on")


@check("profile", needs=("path-is-made",))
def path_can_be_borne(subject: Subject) -> None:
    """A real rig presses what the path says, and a gram-force is a hundredth of a newton.

    State forces in newtons, by default within what a fingertip bears.
    """
    largest = _path(subject).largest_n
    if largest > MOST_N:
        fail("where", f"its largest force is {largest:g} N by default, and no fingertip bears {MOST_N:g} N")


@check("profile", needs=("path-begins-without-load", "path-can-be-borne"), level="silver")
def path_is_recorded(subject: Subject) -> None:
    """A recording has as many samples of the force as the path says: with too few, they miss what it does.

    Give the path samples enough, some in each of its straight pieces.
    """
    if not simulated_sensors(subject):
        skip("no sensor that can be simulated is installed")
    rig, of_rig = simulated_rig(subject)
    path = _path(subject)
    with code_of("where", subject.package):
        made = carried_out(rig, of_rig, simulated_sensors(subject)[0], tiny_scene(profile=path), 1)
    found = pressing_channel(made.reference)
    if found is None:
        skip("the simulated rig records no pressing force")
    stream, column = found
    recorded = float(made.values(stream.name)[:, column].max())
    if abs(recorded - path.largest_n) > FORCE_SHARE * path.largest_n:
        fail("where", f"its {path.samples} samples reach {recorded:.3g} N, and the path {path.largest_n:g} N")


_MADE = ("height-is-finite", "path-is-made")


@check("indenter", "profile", needs=_MADE)
def same_numbers_same_answer(subject: Subject) -> None:
    """A recording says by which numbers it was made, so that it can be made again.

    Compute from the arguments alone, draw nothing at random, and leave the arrays that are given as they are.
    """
    import numpy as np

    if not np.array_equal(_answer(subject), _answer(subject)):
        fail("where", "asked twice it answered differently")
    if subject.kind == "indenter":
        x_mm, y_mm = (np.array(one) for one in _places())
        with code_of("where", subject.package):
            subject.code("where")(x_mm, y_mm, **{name: one.default for name, one in _numbers(subject).items()})
        if not all(np.array_equal(one, other) for one, other in zip((x_mm, y_mm), _places(), strict=True)):
            fail("where", "it has changed x_mm or y_mm")


@check("indenter", "profile", needs=_MADE)
def whole_range_is_answered(subject: Subject) -> None:
    """What a Parameter allows is what somebody will give.

    State `least` and `most` of every Parameter, answer at both, or raise UsageError where two numbers contradict.
    """
    import numpy as np

    for name, one in _numbers(subject).items():
        for end in (one.least, one.most):
            found = None if end is None else _unless_refused(subject, name, end)
            if found is not None and not np.all(np.isfinite(found)):
                fail(f"{_field(subject)}[{name}]", f"at {end:g} {one.unit} the answer is not finite")


@check("indenter", "profile", needs=_MADE)
def every_number_counts(subject: Subject) -> None:
    """A number that changes nothing is a slip of the pen, and whoever varies it learns nothing.

    Use every keyword that the descriptor lists, or take it off.
    """
    import numpy as np

    usual = _answer(subject)
    for name, one in _numbers(subject).items():
        tried = [value for value in (0.5 * one.default, 2 * one.default, one.default + 1, one.least, one.most)
                 if value is not None and one.allows(value) and value != one.default]  # fmt: skip
        found = [_unless_refused(subject, name, value) for value in tried]
        if tried and all(answer is not None and np.array_equal(answer, usual) for answer in found):
            fail(f"{_field(subject)}[{name}]", f"with {tried[0]:g} {one.unit} it answers as with {one.default:g}")


def _unless_refused(subject: Subject, name: str, value: float) -> Any:
    """Return the answer with one number changed; None if the plugin refuses it by UsageError."""
    try:
        return _answer(subject, **{name: value})
    except CheckFailed as failure:
        if isinstance(failure.__cause__, UsageError):
            return None
        raise


CHECKS = (
    numbers_are_described, height_has_the_shape, height_is_finite, lowest_at_the_origin, path_is_made,
    path_begins_without_load, path_can_be_borne, path_is_recorded,
    same_numbers_same_answer, whole_range_is_answered, every_number_counts, indenter_is_pressed,
)  # fmt: skip
