"""Findings about a motion file, with the options that override them."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

NO_ROLE = {
    "helper": "- (follows its parent)",
    "extra": "- (clothes, hair, prop or face)",
    "above the hips": "- (above the hips)",
    "not understood": "? (not understood)",
}
"""Reasons why a joint has no role (``roles.explain``) -> the words for a terminal."""


@dataclass(frozen=True)
class Findings:
    """Facts about a file, and decisions that the file itself leaves open.

    unit:       name and metres of one unit of the file.
    unit_told:  True where the user named it; likewise ``up_told``.
    unit_prescribed: True where it is the unit of the file's format; likewise ``up_prescribed``. Else it is
        a guess.
    other_unit: name of the next best guess, and the metres that the body is tall in it.
    up:         the file's up axis: ``y``, ``z``, ``-x``, ...
    up_sure:    0 to 1.
    notes:      decisions of the reader of the file, and joints that it folded.
    doubts:     parts of the motion that the reader could not keep, or that contradict the format.
    joints:    (joint name, role or the reason why it has none), see ``roles.explain``.
    missing:   essential roles that no joint has.
    height:    metres, the body's role height.
    rest_pose: the kind of rest pose, in words.
    facing:    degrees from +Z towards +X of the body's front in the first frame; None without hips, legs.
    floor:     metres, how far the lowest foot is above the floor (y = 0) most of the time.
    zero_bones: joints that lie in the same place as their parent.
    still:     whether the whole motion is one pose.
    """

    path: Path
    unit: tuple[str, float]
    unit_told: bool
    other_unit: tuple[str, float] | None
    up: str
    up_sure: float
    up_told: bool
    notes: tuple[str, ...]
    joints: tuple[tuple[str, str], ...]
    missing: tuple[str, ...]
    quadruped: bool
    height: float
    rest_pose: str
    facing: float | None
    fps: float
    frames: int
    floor: float
    zero_bones: tuple[str, ...]
    still: bool
    unit_prescribed: bool = False
    up_prescribed: bool = False
    doubts: tuple[str, ...] = ()

    @property
    def not_understood(self) -> tuple[str, ...]:
        """Joints whose names say nothing known."""
        return tuple(name for name, meaning in self.joints if meaning == "not understood")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubtful points, with the option that settles each."""
        out = list(self.doubts)
        low, high = (0.5, 1.8) if self.quadruped else (1.1, 2.6)
        if self.missing:
            out.append(f"no joint is known as {', '.join(self.missing)}: pass a roles file with --roles")
        if not self.unit_told and self.other_unit and not low <= self.height <= high:
            unit, (other, metres) = self.unit[0], self.other_unit
            out.append(
                f"the unit is a guess: in {unit} the body is {self.height:.2f} m tall, in {other} "
                f"{metres:.2f} m; say --unit {unit} or --unit {other}"
            )
        if not (self.up_told or self.up_prescribed) and self.up_sure < 0.5:
            out.append(f"the up axis is a guess ({self.up}): say --up y or --up z")
        if abs(self.floor) > 0.05 * max(self.height, 0.1):
            where = "above" if self.floor > 0 else "below"
            out.append(f"the feet are mostly {abs(self.floor):.2f} m {where} the floor (y = 0)")
        return tuple(out)

    def text(self) -> str:
        """All of it for a terminal."""
        still = ", all the same pose" if self.still else ""
        unit_by = _why(self.unit_told, self.unit_prescribed)
        facing = "unknown" if self.facing is None else f"{self.facing:.0f} degrees from +Z towards +X"
        count = Counter(meaning if meaning in NO_ROLE else "with a role" for _, meaning in self.joints)
        counts = (f"{count[kind]} {kind}" for kind in ("with a role", *NO_ROLE) if count[kind])
        width = max(len(name) for name, _ in self.joints)
        lines = [
            str(self.path),
            f"  frames     {self.frames} at {self.fps:g} per second, {self.frames / self.fps:.1f} s{still}",
            f"  unit       {self.unit[0]} = {self.unit[1]:.4g} m ({unit_by}): height {self.height:.2f} m",
            f"  up axis    {self.up} ({_why(self.up_told, self.up_prescribed)})",
            f"  rest pose  {self.rest_pose}",
            f"  facing     {facing} in the first frame",
            f"  floor      lowest foot {self.floor:+.3f} m, median over time",
            f"  body       {'four legs' if self.quadruped else 'two legs'}, {len(self.joints)} joints: "
            + ", ".join(counts),
            *([f"  no length  {', '.join(self.zero_bones)}"] if self.zero_bones else []),
            *(f"  reader     {note}" for note in self.notes),
            "\nJoints and their roles:",
            *(f"  {name:<{width}}  {NO_ROLE.get(meaning, meaning)}" for name, meaning in self.joints),
        ]
        if self.warnings:
            lines += ["\nLook at:", *(f"  - {warning}" for warning in self.warnings)]
        lines += ["\nTo read the file this way whatever is guessed:"]
        lines += [f"  --unit {self.unit[0]} --up {self.up}"]
        if self.missing or self.not_understood:
            lines += ["\nA roles file to save as roles.toml, correct, and pass with --roles roles.toml:\n"]
            lines += [self.roles_file()]
        return "\n".join(lines)

    def roles_file(self) -> str:
        """TOML for the joints that were not understood, to be filled in."""
        lines = [f"# still wanted: {', '.join(self.missing)}"] if self.missing else []
        for name in self.not_understood:
            escaped = name.replace("\\", "\\\\").replace('"', '\\"')
            lines.append(f'"{escaped}" = "none"')
        return "\n".join(lines) or '# "joint name" = "role", or "none" for no role'


def _why(told: bool, prescribed: bool) -> str:
    return "as told" if told else "as stated" if prescribed else "guessed"
