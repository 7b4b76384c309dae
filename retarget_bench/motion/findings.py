"""Findings about a motion file, with the options that override them."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from retarget_bench.motion import species

NO_ROLE = {
    "helper": "- (follows its parent)",
    "extra": "- (clothes, hair, prop or face)",
    "above the hips": "- (above the hips)",
    "not understood": "? (not understood)",
}
"""Reasons why a joint has no role (``roles.explain``) -> the words for a terminal."""

_RATES = (5.0, 1000.0)
"""Frames per second between which motion is recorded."""


@dataclass(frozen=True)
class Findings:
    """Facts about a file, and decisions that the file itself leaves open.

    unit:       name and metres of one unit of the file.
    unit_explicit: True where the user named it; likewise ``up_explicit``.
    unit_prescribed: True where it is the unit of the file's format; likewise ``up_prescribed``. Else it is
        a guess.
    other_unit: name of the next best guess, and the metres that the body is tall in it (``tall``).
    up:         the file's up axis: ``y``, ``z``, ``-x``, ...
    up_sure:    0 to 1.
    notes:      decisions of the reader of the file, and joints that it folded.
    doubts:     parts of the motion that the reader could not keep, or that contradict the format.
    mirrored:  whether the file was mirrored, as the user said.
    dropped:   what joints below the root did against their parents and was dropped unasked, in words; "".
    joints:    (joint name, role or the reason why it has none), see ``roles.explain``.
    missing:   essential roles that no joint has.
    quadruped: whether it stands on four legs.
    level:     whether its trunk lies along the floor, as that of four-legged bodies and of birds.
    animal:    what a level body is by the name of its file, or "".
    height:    metres, the body's role height.
    stands:    metres from its soles to its top in the reference pose.
    rest_pose: the kind of rest pose, in words.
    facing:    degrees from +Z towards +X of the body's front in the first frame; None without hips, legs.
    floor:     metres, how far the lowest foot is above the floor (y = 0) most of the time.
    grounded:  whether it is on it in between, so that the rest may be steps, ledges and lower floors.
    zero_bones: joints that lie in the same place as their parent.
    still:     whether the whole motion is one pose.
    fps:       frames per second, as the user set them (``rate_explicit``), as the file says, or else as is
                usual in its format.
    fps_stated: frames per second as the file says; None where it does not.
    """

    path: Path
    unit: tuple[str, float]
    unit_explicit: bool
    other_unit: tuple[str, float] | None
    up: str
    up_sure: float
    up_explicit: bool
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
    grounded: bool
    zero_bones: tuple[str, ...]
    still: bool
    level: bool = False
    animal: str = ""
    stands: float = 0.0
    unit_prescribed: bool = False
    up_prescribed: bool = False
    doubts: tuple[str, ...] = ()
    fps_stated: float | None = None
    rate_explicit: bool = False
    dropped: str = ""
    mirrored: bool = False

    @property
    def not_understood(self) -> tuple[str, ...]:
        """Joints whose names are not understood."""
        return tuple(name for name, meaning in self.joints if meaning == "not understood")

    @property
    def tall(self) -> float:
        """Metres by which a unit is told: people's role height, and how tall an animal stands."""
        return self.stands if self.level else self.height

    @property
    def _plausible(self) -> bool:
        """Whether living bodies may be so tall."""
        return species.plausible(self.tall, self.animal) if self.level else 1.1 <= self.height <= 2.6

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubtful points, and what settles each."""
        out = list(self.doubts)
        if self.missing:
            out.append(f"no joint is known as {', '.join(self.missing)}: say which are (roles=FILE)")
        if not self.unit_explicit and self.other_unit and not self._plausible:
            unit, (other, metres) = self.unit[0], self.other_unit
            out.append(
                f"the unit is a guess: in {unit} the body is {self.tall:.2f} m tall, in {other} "
                f"{metres:.2f} m; say unit={unit} or unit={other}"
            )
        if not self.rate_explicit and self.frames > 1 and not _RATES[0] <= self.fps <= _RATES[1]:
            out.append(
                f"the frame rate is {self.fps:g} per second, at which nobody records motion: it would last "
                f"{self.frames / self.fps:.3g} s; say the true rate (rate=30)"
            )
        if not (self.up_explicit or self.up_prescribed) and self.up_sure < 0.5:
            out.append(f"the up axis is a guess ({self.up}): say up=y or up=z")
        if self.frames > 1 and not self.grounded and abs(self.floor) > 0.05 * max(self.height, 0.1):
            where = "above" if self.floor > 0 else "below"
            out.append(f"the feet are mostly {abs(self.floor):.2f} m {where} the floor (y = 0)")
        return tuple(out)

    @property
    def facts(self) -> dict[str, str]:
        """All findings but the joints: heading -> words, in the order of ``text``."""
        still = ", all the same pose" if self.still else ""
        unit_by = _why(self.unit_explicit, self.unit_prescribed)
        if self.animal and not (self.unit_explicit or self.unit_prescribed):
            unit_by += f", for a {self.animal}"
        if self.level and self.other_unit and not (self.unit_explicit or self.unit_prescribed):
            unit_by += f"; in {self.other_unit[0]} {_metres(self.other_unit[1])}"
        legs = "four legs" if self.quadruped else "two legs, the trunk level" if self.level else "two legs"
        facing = "unknown" if self.facing is None else f"{self.facing:.0f} degrees from +Z towards +X"
        count = Counter(meaning if meaning in NO_ROLE else "with a role" for _, meaning in self.joints)
        counts = (f"{count[kind]} {kind}" for kind in ("with a role", *NO_ROLE) if count[kind])
        size = f"stands {_metres(self.stands)} tall" if self.level else f"height {_metres(self.height)}"
        return {
            "frames": f"{self.frames} at {self.fps:g} per second{self._rate_by}, "
            f"{self.frames / self.fps:.1f} s{still}",
            "unit": f"{self.unit[0]} = {self.unit[1]:.4g} m ({unit_by}): {size}",
            "up axis": f"{self.up} ({_why(self.up_explicit, self.up_prescribed)})",
            "rest pose": self.rest_pose,
            "facing": f"{facing} in the first frame",
            "floor": f"lowest foot {self.floor:+.3f} m, median over time",
            "body": f"{legs}, {len(self.joints)} joints: {', '.join(counts)}",
        }

    def text(self) -> str:
        """All of it for a terminal."""
        width = max(len(name) for name, _ in self.joints)
        lines = [
            str(self.path),
            *(f"  {heading:<9}  {words}" for heading, words in self.facts.items()),
            *([f"  no length  {', '.join(self.zero_bones)}"] if self.zero_bones else []),
            *(f"  reader     {note}" for note in self.notes),
            "\nJoints and their roles:",
            *(f"  {name:<{width}}  {NO_ROLE.get(meaning, meaning)}" for name, meaning in self.joints),
        ]
        if self.warnings:
            lines += ["\nLook at:", *(f"  - {warning}" for warning in self.warnings)]
        rate = f",rate={self.fps:g}" if self.rate_explicit or self.fps_stated is None else ""
        lines += ["\nTo read the file this way whatever is guessed:"]
        mirror = ",mirror=true" if self.mirrored else ""
        lines += [f"  '{self.path}[unit={self.unit[0]},up={self.up}{rate}{mirror}]'"]
        if self.missing or self.not_understood:
            lines += [
                "\nbench doctor --save reading.toml writes a table of joints and roles to be corrected:"
            ]
            lines += [f"  '{self.path}[reading=reading.toml]'"]
        return "\n".join(lines)

    @property
    def _rate_by(self) -> str:
        if not self.rate_explicit:
            return "" if self.fps_stated is not None else " (usual in this format: the file does not say)"
        stated = "nothing" if self.fps_stated is None else f"{self.fps_stated:g}"
        return f" (as told; the file says {stated})"


def counted_frames(count: int) -> str:
    """``1 frame``, ``20 frames``."""
    return f"{count} frame{'s' * (count != 1)}"


def _metres(length: float) -> str:
    """``1.62 m``, and ``0.083 m`` of what is small."""
    return f"{length:.2f} m" if length >= 0.2 else f"{length:.3f} m"


def _why(explicit: bool, prescribed: bool) -> str:
    return "as told" if explicit else "as stated" if prescribed else "guessed"
