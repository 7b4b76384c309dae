"""Shared conventions: frame rate, sides, gravity."""

FPS = 30.0


SIDES = ("left", "right")


def sign(side: str) -> int:
    """+1 for left (left is +X), -1 for right."""
    return 1 if side == "left" else -1


GRAVITY = 9.81 / 0.92 / 30.0**2
"""Leg lengths per frame and frame, on a leg of 0.92 m: a man's of mean stature."""
