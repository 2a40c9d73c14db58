"""Model of a linear motor under force control: controller, filter, and limits of the motor."""

from __future__ import annotations

from typing import Literal

from tactbench.core.spec.quantity import Frozen, Quantity, assumed, derived

_PAPER_LOOP = "Karl et al. 2016 state a low-pass filter in the loop; neither controller, gains nor motor"


class ForceLoop(Frozen):
    """A force loop around a position-controlled linear motor.

    Once per step, the force is read and filtered, and a proportional-integral controller turns its difference from
    the profile into a position command. The defaults are plausible; the paper states none of them.
    """

    kind: Literal["force loop"] = "force loop"
    proportional: Quantity = assumed(0.15, "mm/N", _PAPER_LOOP)
    """Proportional gain: position for each newton of missing force [length / force]."""
    integral: Quantity = assumed(1.0, "mm/N/s", _PAPER_LOOP)
    """Integral gain: speed for each newton of missing force [length / force / time]."""
    cutoff: Quantity | None = assumed(1.0, "Hz", f"{_PAPER_LOOP}: no cut-off either")
    """Cut-off of the first-order low-pass on the measured force [1/time]; None: there is no filter."""
    rate: Quantity | None = None
    """Rate of the control loop [1/time]; None: the rate of the reference clock."""
    delay: Quantity = assumed(
        10.0, "ms", "RS232, as the paper says, at 9600 baud: a command and its answer of 9 to 10 bytes of 10 bits"
    )
    """Time between reading the force and the arrival of the command at the motor [time], rounded up to whole steps."""
    motor_lag: Quantity = assumed(10.0, "ms", "closed position loop of a small linear motor; no source")
    """Time constant with which the motor approaches a commanded position [time]."""
    speed: Quantity = assumed(50.0, "mm/s", "small linear motors reach metres per second; set low for pressing")
    """Largest speed of the motor [length / time]."""
    acceleration: Quantity = assumed(1000.0, "mm/s/s", "a tenth of gravity; drives allow it to be set")
    """Largest acceleration of the motor [length / time^2]."""
    resolution: Quantity = derived(
        0.02, "N", "12 bits on +-10 V of a Nano17 with 3.7 N/V in its worst gauge, upper end of 8 to 20 mN"
    )
    """Resolution of the force measurement [force]."""
