"""Points drawn on moving surfaces, each part of the surface as likely as its area is large."""

import numpy as np


def uniform(seed: int, count: int) -> np.ndarray:
    """``(count,)`` numbers between 0 and 1, neither included, from the raw bits of Philox: NumPy
    promises to keep the bits of its generators, but not the distributions that it makes of them."""
    raw = np.random.Philox(key=seed).random_raw(count)
    return np.asarray(((raw >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def sampled(vertices: np.ndarray, faces: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """``(frames, points, 3)`` metres: points on the triangles of every frame, uniform by area.

    vertices: ``(frames, V, 3)``. faces: ``(F, 3)``. numbers: ``(frames, 3, points)`` uniform in [0, 1): the
    first chooses a triangle, the others the place in it (Osada et al. 2002, equation 1).
    """
    points = np.empty((len(vertices), numbers.shape[2], 3))
    for frame, (corners, (which, first, second)) in enumerate(zip(vertices, numbers, strict=True)):
        a, b, c = (corners[faces[:, corner]] for corner in range(3))
        total = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
        chosen = np.searchsorted(total, which * total[-1], side="right")
        chosen = np.minimum(chosen, len(faces) - 1)
        root = np.sqrt(first)[:, None]
        way = second[:, None]
        points[frame] = (1 - root) * a[chosen] + root * ((1 - way) * b[chosen] + way * c[chosen])
    return points
