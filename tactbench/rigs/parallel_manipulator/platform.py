"""The manipulator's platform: where it may go, the way there in an order that keeps the indenter off the sensor.

The motor is retracted first (the guard lets no rail move before), then: up to the clearance plane, sideways there, down
to the stand-off. Every move is tested before the first one is made, and carried out by way points, at each of which all
rails come to rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from tactbench.rigs.parallel_manipulator.kinematics import forward, inverse
from tactbench.rigs.parallel_manipulator.settings import JOINTS, RigSettings
from tactbench.rigs.parallel_manipulator.workspace import Workspace

NEAR_M = 0.2e-3
"""How far the measured place may be from where it was sent (assumed: three rails, each within a drive's corridor)."""

Place = tuple[float, float, float]
"""x, y, z of the manipulator's point [m]."""


class Platform:
    """The platform of a rig's settings; use :meth:`of`."""

    def __init__(self, workspace: Workspace, settings: RigSettings) -> None:
        self.workspace, self._settings = workspace, settings

    @classmethod
    def of(cls, settings: RigSettings) -> Platform | None:
        """Return the platform; None: the manipulator is fixed."""
        if settings.manipulator == "fixed":
            return None
        return cls(Workspace(settings.manipulator, settings.postures), settings)

    def check(self) -> None:
        """Raise PlaceRefusedError unless presses at all corners of what may be asked for are permitted.

        With straight rails the permitted places are convex, so the rectangle between the corners is as well.
        """
        corners = self._settings.places.corners_m()
        here = (*corners[0], self._settings.heights.clearance_m)
        for corner in (*corners, corners[0], corners[2]):
            here = self.way(here, corner)[-1]

    def way(self, here_m: Place, xy_m: tuple[float, float]) -> list[Place]:
        """Return the places of a way from here to the stand-off above `xy_m`, all moves tested.

        Raises
        ------
        PlaceRefusedError
            If one is not permitted; nothing has moved.
        """
        heights = self._settings.heights
        x, y, z = here_m
        top = max(z, heights.clearance_m)
        places = [here_m, (x, y, top), (*xy_m, top), (*xy_m, heights.stand_off_m)]
        for start, end in pairwise(places):
            self.workspace.check_move(np.array(start), np.array(end))
        return places

    def targets(self, way: list[Place]) -> Iterator[dict[str, float]]:
        """Yield joint positions [m], by name, of the way points of a way."""
        spacing_m = 1e-3 * self._settings.places.way_point_mm
        for start, end in pairwise(np.array(place) for place in way):
            pieces = math.ceil(float(np.linalg.norm(end - start)) / spacing_m)
            for n in range(1, pieces + 1):
                q = inverse(self.workspace.delta, start + n / pieces * (end - start))
                yield dict(zip(JOINTS, q.tolist(), strict=True))

    def place_m(self, positions: Mapping[str, float]) -> Place:
        """Return where the platform is by the positions of its rails [m]; raises ClosureError."""
        x, y, z = forward(self.workspace.delta, np.array([positions[name] for name in JOINTS])).tolist()
        return x, y, z
