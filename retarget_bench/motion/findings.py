"""Findings about a motion file, with the options that override them."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Reading:
    """Decisions that the file itself leaves open.

    unit:        name and metres of one unit of the file.
    unit_told:   whether the user said it, and did not leave it to a guess; likewise ``up_told``.
    other_units: (name, metres that the body is tall in it) of the next best guesses.
    up:          the file's up axis: ``y``, ``z``, ``-x``, ...
    up_sure:     0 to 1.
    notes:       what the reader of the file decided or folded.
    """

    unit: tuple[str, float]
    unit_told: bool
    other_units: tuple[tuple[str, float], ...]
    up: str
    up_sure: float
    up_told: bool
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Findings:
    """Facts and decisions of one import.

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
    reading: Reading
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

    @property
    def not_understood(self) -> tuple[str, ...]:
        """Joints whose names say nothing known."""
        return tuple(name for name, meaning in self.joints if meaning == "not understood")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubtful points, with the option that settles each."""
        out = []
        unit, told = self.reading.unit[0], self.reading.unit_told
        if self.missing:
            out.append(f"no joint is known as {', '.join(self.missing)}: pass a roles file with --roles")
        if not told and self.doubtful_unit:
            other, metres = self.reading.other_units[0]
            out.append(
                f"the unit is a guess: in {unit} the body is {self.height:.2f} m tall, in {other} "
                f"{metres:.2f} m; say --unit {unit} or --unit {other}"
            )
        if not self.reading.up_told and self.reading.up_sure < 0.5:
            out.append(f"the up axis is a guess ({self.reading.up}): say --up y or --up z")
        if abs(self.floor) > 0.05 * max(self.height, 0.1):
            where = "above" if self.floor > 0 else "below"
            out.append(f"the feet are mostly {abs(self.floor):.2f} m {where} the floor (y = 0)")
        return tuple(out)

    @property
    def doubtful_unit(self) -> bool:
        """Whether the body is oddly tall or small in its unit."""
        low, high = (0.5, 1.8) if self.quadruped else (1.1, 2.6)
        return bool(self.reading.other_units) and not low <= self.height <= high

    def text(self) -> str:
        """All of it for a terminal."""
        lines = [str(self.path), *self._body_lines(), "", "Joints and their roles:", *self._joint_lines()]
        if self.warnings:
            lines += ["", "Look at:", *(f"  - {warning}" for warning in self.warnings)]
        lines += ["", "To read the file this way whatever is guessed:", f"  {self.options()}"]
        if self.missing or self.not_understood:
            lines += [
                "",
                "A roles file to save as roles.toml, correct, and pass with --roles roles.toml:",
                "",
            ]
            lines += [self.roles_file()]
        return "\n".join(lines)

    def options(self) -> str:
        """The options that say what was decided."""
        return f"--unit {self.reading.unit[0]} --up {self.reading.up}"

    def _body_lines(self) -> list[str]:
        reading, told = self.reading, {True: "as told", False: "guessed"}
        still = ", all the same pose" if self.still else ""
        lines = [
            f"  frames     {self.frames} at {self.fps:g} per second, {self.frames / self.fps:.1f} s{still}",
            f"  unit       {reading.unit[0]} = {reading.unit[1]:.4g} m ({told[reading.unit_told]}): "
            f"height {self.height:.2f} m",
            f"  up axis    {reading.up} ({told[reading.up_told]})",
            f"  rest pose  {self.rest_pose}",
            f"  facing     {_facing(self.facing)} in the first frame",
            f"  floor      lowest foot {self.floor:+.3f} m, median over time",
            f"  body       {'four legs' if self.quadruped else 'two legs'}, {len(self.joints)} joints: "
            + self._counts(),
        ]
        if self.zero_bones:
            lines.append(f"  no length  {', '.join(self.zero_bones)}")
        return lines + [f"  reader     {note}" for note in reading.notes]

    def roles_file(self) -> str:
        """TOML for the joints that were not understood, to be filled in."""
        lines = []
        if self.missing:
            lines.append(f"# still wanted: {', '.join(self.missing)}")
        lines += [f'{_quoted(name)} = "none"' for name in self.not_understood]
        return "\n".join(lines) or '# "joint name" = "role", or "none" for no role'

    def _counts(self) -> str:
        reasons = ("helper", "extra", "above the hips", "not understood")
        count = Counter(meaning if meaning in reasons else "with a role" for _, meaning in self.joints)
        return ", ".join(f"{count[kind]} {kind}" for kind in ("with a role", *reasons) if count[kind])

    def _joint_lines(self) -> list[str]:
        width = max((len(name) for name, _ in self.joints), default=0)
        return [f"  {name:<{width}}  {_meaning(meaning)}" for name, meaning in self.joints]


def _meaning(meaning: str) -> str:
    words = {
        "helper": "- (follows its parent)",
        "extra": "- (clothes, hair, prop or face)",
        "above the hips": "- (above the hips)",
        "not understood": "? (not understood)",
    }
    return words.get(meaning, meaning)


def _facing(degrees: float | None) -> str:
    if degrees is None:
        return "unknown"
    return f"{degrees:.0f} degrees from +Z towards +X"


def _quoted(name: str) -> str:
    """A TOML basic string."""
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
