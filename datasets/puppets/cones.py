"""Round cones around the bones of a body, and the joints that the skin near them follows."""

import numpy as np


class Cones:
    """Cones in the T-pose, each the hull of two balls.

    start, line: ``(cones, 3)`` metres: the middle of one ball, and the way from there to the other's.
    radii:       ``(cones, 2)`` metres, of both balls.
    follows:     ``(cones, joints)`` shares of the joints in the skin of each cone.
    spread:      metres: how far the pull of a cone reaches into the skin of the next.
    """

    def __init__(
        self, start: np.ndarray, line: np.ndarray, radii: np.ndarray, follows: np.ndarray, spread: float
    ) -> None:
        self.start, self.line, self.radii = start, line, radii
        self.follows, self.spread = follows, spread

    def distances(self, points: np.ndarray) -> np.ndarray:
        """``(cones, points)`` metres."""
        return np.stack([self._distance(cone, points.T) for cone in range(len(self.line))])

    def _distance(self, cone: int, points: np.ndarray) -> np.ndarray:
        """``(points,)`` metres from one cone; points ``(3, points)``."""
        line, (near, far) = self.line[cone], self.radii[cone]
        x, y, z = (points[axis] - self.start[cone, axis] for axis in range(3))
        square = max(float(line @ line), 1e-12)
        along = np.clip((x * line[0] + y * line[1] + z * line[2]) / square, 0.0, 1.0)
        apart = (x - along * line[0]) ** 2 + (y - along * line[1]) ** 2 + (z - along * line[2]) ** 2
        return np.sqrt(apart) - (near + along * (far - near))

    def weights(self, points: np.ndarray) -> np.ndarray:
        """``(points, joints)`` shares of the joints, fading with the distance from their cones."""
        each = self.distances(points)
        pull = np.exp((each.min(axis=0) - each) / self.spread)
        return (pull / pull.sum(axis=0)).T @ self.follows
