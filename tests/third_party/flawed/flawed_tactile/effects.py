"""Effects with one flaw each. None is ever called for: a scene gets one only by name."""

from tactbench.plugin import hookimpl
from tactbench.plugin.simulation import EffectDescriptor

TACTBENCH_API = 2
STAGES = ("that-breaks", "of-nan", "that-draws-elsewhere", "that-changes-the-sensor")
REASONS = ("that-says-yes", "without-a-reason", "of-two-minds")


@hookimpl
def tactbench_effects():
    def effect(name, **changes):
        code = {"where": "flawed_tactile.stages:sound", "called_for": "flawed_tactile.stages:never"}
        return EffectDescriptor(**{"name": name, "title": "A ripple", "produces": ("disturbance",), **code, **changes})

    return [
        effect("sound-effect"),
        effect("effect_with_an_underscore"),
        effect("effect-of-unknown-tokens", consumes=("skinn",)),
        effect("effect-for-nobody", produces=("disturbanse",)),
        *(effect(f"effect-{one}", where=f"flawed_tactile.stages:{one.replace('-', '_')}") for one in STAGES),
        *(effect(f"effect-{one}", called_for=f"flawed_tactile.stages:{one.replace('-', '_')}") for one in REASONS),
    ]
