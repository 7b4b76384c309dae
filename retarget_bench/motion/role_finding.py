"""Roles of a skeleton's joints, found by their names and by the tree.

Names decide, by the table of ``role_aliases.py``, and the tree checks: the joints of a limb must hang below
each other in anatomical order, and the hips are the joint that carries both the legs and the spine,
whatever they are called. Chains are complete: a joint between two known ones of a chain (hips to head,
trunk to hand, hips to foot) belongs to it, whatever it is called, unless it divides a bone or lies where
its parent does.
"""

import difflib
from collections.abc import Mapping, Sequence, Set
from itertools import combinations, pairwise

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import role_aliases as aliases
from retarget_bench.motion.role_aliases import LIMBS, NUMBERED_FINGERS
from retarget_bench.motion.roles import (
    LIMB_ROLES,
    SIDES,
    Roles,
    ancestors,
    body_part,
    bones,
    common_ancestor,
    is_role,
    no_role,
)
from retarget_bench.motion.skeleton import Skeleton

_MOST = 20
"""Joints inside a bone of a limb beyond which none is looked for among them."""


def find(skeleton: Skeleton, overrides: Mapping[str, str | None] | None = None) -> Roles:
    """The role of every joint, or None.

    overrides: joint name -> role, or None for no role; they win over the names.
    Raises SkeletonError when an override names no joint or no role, or gives one role twice.
    """
    search = _Search(skeleton, _checked(skeleton, overrides or {}))
    search.find_limbs()
    search.find_head()
    if search.find_hips():
        search.find_trunk()
        search.find_tail()
        search.find_starts_of_limbs()
    search.find_ends()
    role_of = {joint: role for role, joint in search.joint_of.items()}
    return tuple(role_of.get(joint) for joint in range(len(skeleton)))


def _checked(skeleton: Skeleton, overrides: Mapping[str, str | None]) -> dict[int, str | None]:
    """Overrides by joint index."""
    out: dict[int, str | None] = {}
    for name, role in overrides.items():
        if name not in skeleton.names:
            near = difflib.get_close_matches(name, skeleton.names, 3) or [*skeleton.names[:8], "..."]
            raise SkeletonError(f"role override: there is no joint {name!r}; try {', '.join(near)}")
        if role is not None and not is_role(role):
            raise SkeletonError(f"role override of {name!r}: {no_role(role)}")
        if role is not None and role in out.values():
            raise SkeletonError(f"role override: {role!r} is given to two joints")
        out[skeleton.index(name)] = role
    return out


class _Search:
    """The roles of a skeleton's joints that are known so far (``joint_of``: role -> joint).

    forced: joint -> role, or None for no role; no other joint gets these roles, nor these joints others.
    """

    def __init__(self, skeleton: Skeleton, forced: Mapping[int, str | None]) -> None:
        self.skeleton = skeleton
        self.names = aliases.read(skeleton.names)
        self.joint_of = {role: joint for joint, role in forced.items() if role is not None}
        self.free = set(range(len(skeleton))) - forced.keys()

    def give(self, roles: Mapping[str, int]) -> None:
        """Note role -> joint, of roles and joints that are free."""
        for role, joint in roles.items():
            if joint in self.free and role not in self.joint_of:
                self.joint_of[role] = joint
                self.free.remove(joint)

    def unsided(self, joints: Sequence[int], stems: Set[str]) -> list[int]:
        """Those of ``joints`` whose names have no side and one of these stems."""
        return [joint for joint in joints if not self.names[joint].side and self.names[joint].stem in stems]

    def bends(self, joint: int) -> bool:
        """Whether a free joint between two others has a place and a bend of its own, unlike helpers."""
        divides = aliases.DIVIDING_WORDS.intersection(self.names[joint].words)
        return joint in self.free and bool(self.skeleton.bone_lengths[joint] > 0) and not divides

    # ---------------------------------------------------------------------------------------- limbs
    def find_limbs(self) -> None:
        """Arms and legs: per side and limb the best run of joints below each other in anatomical order, and
        what lies between these."""
        for side in SIDES:
            hocked = any(n.side == side and n.stem in aliases.HOCK_STEMS for n in self.names)
            stems = aliases.LIMB_STEMS | (aliases.HOCKED if hocked else {})
            for parts in LIMBS.values():
                options: dict[int, dict[int, float]] = {}
                for joint in sorted(self.free):
                    name = self.names[joint]
                    meanings = [part for part in stems.get(name.stem, ()) if part in parts]
                    if name.side == side and meanings:
                        options[joint] = {parts.index(m): 1.0 - 0.1 * k for k, m in enumerate(meanings)}
                run = {parts[rank]: joint for joint, rank in _best_run(self.skeleton, options)}
                run |= {
                    part: self.joint_of[f"{side}_{part}"]
                    for part in parts
                    if f"{side}_{part}" in self.joint_of
                }
                run |= self._inside(run, parts)
                if "shoulder" in run and "arm" not in run and self.means_arm(run["shoulder"]):
                    run["arm"] = run.pop("shoulder")
                self.give({f"{side}_{part}": joint for part, joint in run.items()})

    def means_arm(self, joint: int) -> bool:
        """Whether a joint of the shoulder may be where the arm begins, by its name."""
        return "arm" in aliases.LIMB_STEMS.get(self.names[joint].stem, ())

    def _inside(self, run: Mapping[str, int], parts: Sequence[str]) -> dict[str, int]:
        """The joints of a limb that lie between others of it, or that end it, whatever they are called.

        run: part -> joint, of what is known by name. parts: the limb's parts, from the body outwards.
        """
        out: dict[str, int] = {}
        for above, below in pairwise(part for part in parts if part in run):
            missing = parts[parts.index(above) + 1 : parts.index(below)]
            out |= self._between(run[above], run[below], missing)
        joints = {**run, **out}
        for bend, end in (("forearm", "hand"), ("leg", "foot"), ("foot", "toe")):
            ends = self.skeleton.children[joints[bend]] if bend in joints and end not in joints else ()
            numbered = len(ends) == 1 and self.names[ends[0]].stem == self.names[joints[bend]].stem
            if len(ends) == 1 and self.bends(ends[0]) and (numbered or bend != "foot"):
                out[end] = joints[end] = ends[0]
        return out

    def _between(self, high: int, low: int, parts: Sequence[str]) -> dict[str, int]:
        """Part -> joint, of as many of the last ``parts`` of a limb as there are joints between two.

        Of more joints those count that divide the limb into the most even bones: others stand for the twist
        of one.
        """
        line = _line(self.skeleton, high, low)
        inner = [joint for joint in line[1:-1] if self.bends(joint)]
        count = min(len(parts), len(inner))
        if not count or len(inner) > _MOST:
            return {}
        choices = combinations(inner, count)
        best = max(choices, key=lambda joints: _shortest(self.skeleton, (high, *joints, low)))
        return dict(zip(parts[-count:], best, strict=True))

    def find_starts_of_limbs(self) -> None:
        """The joints of limbs between the trunk and those that are known, whatever they are called."""
        role_of = {joint: role for role, joint in self.joint_of.items()}
        for limb in LIMB_ROLES.values():
            top = next((role for role in limb if role in self.joint_of), None)
            above = ancestors(self.skeleton, self.joint_of[top]) if top else []
            over = next((joint for joint in above if joint in role_of), None)
            if top and over is not None and body_part(role_of[over]) == "trunk":
                self.give(self._between(over, self.joint_of[top], limb[: limb.index(top)]))

    def tops(self, limb: str) -> list[int]:
        """The known joints nearest the body of both arms or legs."""
        chains = ([r for r in LIMB_ROLES[f"{side}_{limb}"] if r in self.joint_of] for side in SIDES)
        return [self.joint_of[chain[0]] for chain in chains if chain]

    # ---------------------------------------------------------------------------------------- trunk
    def find_head(self) -> None:
        """The head, by name; or else the last joint of the trunk's line above the arms."""
        heads = self.unsided(sorted(self.free), aliases.HEAD_STEMS)
        carrier = self.carrier_of_arms()
        if not heads and carrier is not None:
            line = self._line_up(carrier)
            heads = [joint for joint in line[-1:] if self.names[joint].stem not in aliases.NECK_STEMS]
        self.give(dict.fromkeys(["head"], heads[0]) if heads else {})

    def carrier_of_arms(self) -> int | None:
        """The joint of the trunk that the arms hang from."""
        arms = self.tops("arm")
        above = [int(self.skeleton.parents[joint]) for joint in arms]
        return common_ancestor(self.skeleton, above) if above and min(above) >= 0 else None

    def _line_up(self, joint: int) -> list[int]:
        """The joints that hang below each other from the arms' carrier on: neck and head, by the tree."""
        arms = {above for top in self.tops("arm") for above in ancestors(self.skeleton, top, itself=True)}
        others = aliases.EXTRA_WORDS | aliases.HELPER_WORDS
        line: list[int] = []
        while True:
            below = [
                child
                for child in self.skeleton.children[joint]
                if child in self.free
                and child not in arms
                and not self.names[child].side
                and not others.intersection(self.names[child].words)
                and self.names[child].stem not in aliases.HEAD_TOP_STEMS
            ]
            if len(below) != 1:
                return line
            joint = below[0]
            line.append(joint)

    def find_hips(self) -> bool:
        """The joint that carries both the legs and the upper body; by name where there are no limbs."""
        legs, upper = self.tops("leg"), self.tops("arm")
        upper += [self.joint_of["head"]] if "head" in self.joint_of else []
        if legs and upper:
            hips = common_ancestor(self.skeleton, legs + upper)
        else:
            hips = next(iter(self.unsided(range(len(self.names)), aliases.HIPS_STEMS)), None)
        self.give({} if hips is None else {"hips": hips})
        return "hips" in self.joint_of

    def find_trunk(self) -> None:
        """Spine and neck: all that bends on the way from the hips to the head, or to the arms.

        The neck begins at the first joint of its name; without one, above the joint that carries the arms.
        """
        carrier, hips = self.carrier_of_arms(), self.joint_of["hips"]
        top = self.joint_of.get("head", carrier)
        if top is None:
            return
        trunk = aliases.SPINE_STEMS | aliases.NECK_STEMS
        line = [
            joint
            for joint in _line(self.skeleton, hips, top)[1:]
            if joint in self.free
            and (self.names[joint].stem in trunk or self.bends(joint))
            and self.names[joint].stem not in aliases.HIPS_STEMS
        ]
        necks = self.unsided(line, aliases.NECK_STEMS)
        first = line.index(necks[0]) if necks else len(line)
        if not necks and carrier in line:
            first = line.index(carrier) + 1
        neck = line[first:]
        self.give({f"spine_{k}": joint for k, joint in enumerate(line[:first], 1)})
        self.give({f"neck_{k}" if len(neck) > 1 else "neck": joint for k, joint in enumerate(neck, 1)})

    def find_tail(self) -> None:
        """The longest line of joints of a tail below the hips, or below what carries them.

        In rigs of animals the hips, the joint between legs and trunk, often are a spine, and the tail hangs
        from the pelvis above it.
        """
        carrying = set(ancestors(self.skeleton, self.joint_of["hips"], itself=True))
        lines: dict[int, list[int]] = {}
        for joint in self.unsided(range(len(self.names)), aliases.TAIL_STEMS):
            over = ancestors(self.skeleton, joint)
            if carrying.intersection(over) and joint not in carrying:
                lines[joint] = [*max((lines[j] for j in over if j in lines), key=len, default=[]), joint]
        longest = max(lines.values(), key=len, default=[])
        self.give({f"tail_{k}": joint for k, joint in enumerate(longest, 1)})

    # ---------------------------------------------------------------------------------------- ends
    def find_ends(self) -> None:
        """Head top and fingers: what hangs below the head and the hands."""
        for joint, name in enumerate(self.names):
            above = set(ancestors(self.skeleton, joint))
            if name.stem in aliases.HEAD_TOP_STEMS and self.joint_of.get("head") in above:
                self.give({"head_top": joint})
            if self.joint_of.get(f"{name.side}_hand") in above:
                finger = aliases.finger_of(name.words)
                if name.stem == "finger" and len(name.numbers) == 2 and 1 <= name.numbers[0] <= 5:
                    finger = NUMBERED_FINGERS[name.numbers[0] - 1]
                if finger is not None:
                    self.give({f"{name.side}_{finger}_{(name.numbers or (1,))[-1] or 1}": joint})


def _best_run(skeleton: Skeleton, options: Mapping[int, Mapping[int, float]]) -> list[tuple[int, int]]:
    """(joint, rank) along one line of descent, ranks rising, with the largest sum of weights.

    Ties go to the joint nearest the body. options: joint -> rank -> weight.
    """
    best: dict[tuple[int, int], tuple[float, list[tuple[int, int]]]] = {}
    for joint in sorted(options):
        above = set(ancestors(skeleton, joint))
        for rank, weight in options[joint].items():
            runs = [run for (a, r), run in best.items() if a in above and r < rank]
            score, run = max(runs, key=lambda each: each[0], default=(0.0, []))
            best[joint, rank] = (score + weight, [*run, (joint, rank)])
    return max(best.values(), key=lambda each: each[0], default=(0.0, []))[1]


def _line(skeleton: Skeleton, high: int, low: int) -> list[int]:
    """The joints from ``high`` down to ``low``, both included; none where it is not above."""
    line = ancestors(skeleton, low, itself=True)
    return line[line.index(high) :: -1] if high in line else []


def _shortest(skeleton: Skeleton, line: Sequence[int]) -> float:
    """Metres of the shortest way from a joint to the next of a line of descent."""
    return min(bones(skeleton, below, above) for above, below in pairwise(line))
