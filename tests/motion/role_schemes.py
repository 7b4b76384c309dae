"""Naming schemes of rigs, each on one body of 1.7 m in a T-pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion.skeleton import Skeleton

ARM = ("shoulder", "arm", "forearm", "hand")
LEG = ("up_leg", "leg", "foot", "toe")


@dataclass(frozen=True)
class Scheme:
    """Names of a body's joints, separated by ``|``, from the hips outwards; ``#`` stands for the side.

    ``(name)`` is a joint of no role inside a bone, ``[name]`` one beside what follows.
    trunk: the hips, with what carries them before a ``/``, and the spine. neck: neck and head.
    arm: with a shoulder or without. leg: with a toe or without. sides: the words for left and right.
    around: what stands before and behind every name.
    """

    trunk: str
    neck: str
    arm: str
    leg: str
    sides: tuple[str, str] = ("L", "R")
    around: tuple[str, str] = ("", "")

    def body(self) -> tuple[Skeleton, dict[str, str | None]]:
        """The skeleton, and the role of every joint."""
        above, _, trunk = self.trunk.rpartition("/")
        hips, *spine = trunk.split("|")
        *neck, head = self.neck.split("|")
        body = _Body(self.around)
        for name in above.split("|") if above else []:
            body.add([name], [None], [(0.0, 0.0, 0.0)])
        body.add([hips], ["hips"], [(0.0, 1.0, 0.0)])
        middle = body.last
        body.add(spine, _numbered("spine", spine), _steps((0, 1.0, 0), (0, 1.4, 0), len(spine)))
        chest = body.last
        body.add(neck, _numbered("neck", neck), _steps((0, 1.4, 0), (0, 1.52, 0), len(neck)))
        body.add([head], ["head"], [(0.0, 1.6, 0.0)])
        for side, word, left in zip(("left", "right"), self.sides, (1.0, -1.0), strict=True):
            names = self.arm.replace("#", word).split("|")
            count = sum(name[0] not in "([" for name in names)
            places = [(0.05 * left, 1.38, 0), (0.18 * left, 1.4, 0), (0.46 * left, 1.4, 0)]
            places.append((0.72 * left, 1.4, 0))
            body.add(names, [f"{side}_{part}" for part in ARM[4 - count :]], places[4 - count :], chest)
            names = self.leg.replace("#", word).split("|")
            places = [(0.09 * left, 0.95, 0), (0.09 * left, 0.5, 0.01), (0.09 * left, 0.08, -0.02)]
            places.append((0.09 * left, 0.02, 0.12))
            body.add(names, [f"{side}_{part}" for part in LEG], places, middle)
        return body.skeleton(), body.roles


class _Body:
    """Joints as they are added, by their places in the world."""

    def __init__(self, around: tuple[str, str]) -> None:
        self.around = around
        self.roles: dict[str, str | None] = {}
        self.parents: list[int] = []
        self.places: list[Sequence[float]] = []

    @property
    def last(self) -> int:
        return len(self.parents) - 1

    def add(
        self,
        names: Sequence[str],
        roles: Sequence[str | None],
        places: Sequence[Sequence[float]],
        parent: int | None = None,
    ) -> None:
        """A line of joints below a parent, by default the last. roles, places: of those that have one."""
        above = self.last if parent is None else parent
        rest, where = list(roles), list(places)
        for name in names:
            bare = name[1:-1] if name[0] in "([" else name
            here = self.places[above] if above >= 0 else (0.0, 0.0, 0.0)
            if name[0] == "(":
                place: Sequence[float] = (np.array(here) + where[0]) / 2
            else:
                place = np.add(here, (0.0, 0.0, 0.01)) if name[0] == "[" else where.pop(0)
            self.roles[bare.join(self.around)] = None if name[0] in "([" else rest.pop(0)
            self.parents.append(above)
            self.places.append(place)
            above = above if name[0] == "[" else self.last

    def skeleton(self) -> Skeleton:
        places, parents = np.array(self.places, dtype=float), np.array(self.parents)
        offsets = places - np.where(parents[:, None] >= 0, places[parents], 0.0)
        return Skeleton(tuple(self.roles), parents, offsets)


def _numbered(stem: str, names: Sequence[str]) -> list[str | None]:
    count = sum(name[0] not in "([" for name in names)
    return [stem if stem == "neck" and count == 1 else f"{stem}_{k}" for k in range(1, count + 1)]


def _steps(low: Sequence[float], high: Sequence[float], count: int) -> list[Sequence[float]]:
    return [np.array(low) + (np.array(high) - low) * k / max(count, 1) for k in range(1, count + 1)]


_MIXAMO_ARM = "#Shoulder|#Arm|#ForeArm|#Hand"
_MIXAMO_LEG = "#UpLeg|#Leg|#Foot|#ToeBase"
_WORDS = ("Left", "Right")
_BIPED = "# Clavicle|# UpperArm|# Forearm|# Hand", "# Thigh|# Calf|# Foot|# Toe0"
_BONES = "shoulder.#|upper_arm.#|forearm.#|hand.#", "thigh.#|shin.#|foot.#|toe.#"
_SPINES = "spine|spine.001|spine.002|spine.003", "spine.004|spine.005|spine.006"
_DAZ_TRUNK = "hip|abdomenLower|abdomenUpper|chestLower|chestUpper"
_CC_ARM = "#_Clavicle|#_Upperarm|[#_UpperarmTwist01]|#_Forearm|[#_ForearmTwist01]|#_Hand"
_CC_LEG = "#_Thigh|[#_ThighTwist01]|#_Calf|[#_CalfTwist01]|#_Foot|#_ToeBase"
_VICON = "pelvis|thorax", "head", "#clavicle|#humerus|#radius|#hand", "#femur|#tibia|#foot|#toes"

SCHEMES = {
    "Mixamo": Scheme(
        "Hips|Spine|Spine1|Spine2", "Neck|Head", _MIXAMO_ARM, _MIXAMO_LEG, _WORDS, ("mixamorig:", "")
    ),
    "Unreal": Scheme(
        "root/pelvis|spine_01|spine_02|spine_03|spine_04|spine_05",
        "neck_01|neck_02|head",
        "clavicle_#|upperarm_#|[upperarm_twist_01_#]|lowerarm_#|[lowerarm_twist_01_#]|hand_#",
        "thigh_#|[thigh_twist_01_#]|calf_#|[calf_twist_01_#]|foot_#|ball_#",
        ("l", "r"),
    ),
    "Unity": Scheme(
        "Hips|Spine|Chest|UpperChest",
        "Neck|Head",
        "#Shoulder|#UpperArm|#LowerArm|#Hand",
        "#UpperLeg|#LowerLeg|#Foot|#Toes",
        _WORDS,
    ),
    "Rigify": Scheme(
        *_SPINES,
        "shoulder.#|upper_arm.#|(upper_arm.#.001)|forearm.#|(forearm.#.001)|hand.#",
        "thigh.#|(thigh.#.001)|shin.#|(shin.#.001)|foot.#|toe.#",
        around=("DEF-", ""),
    ),
    "metarig": Scheme(*_SPINES, *_BONES),
    "VRM": Scheme(
        "Root/J_Bip_C_Hips|J_Bip_C_Spine|J_Bip_C_Chest|J_Bip_C_UpperChest",
        "J_Bip_C_Neck|J_Bip_C_Head",
        "J_Bip_#_Shoulder|J_Bip_#_UpperArm|J_Bip_#_LowerArm|J_Bip_#_Hand",
        "J_Bip_#_UpperLeg|J_Bip_#_LowerLeg|J_Bip_#_Foot|J_Bip_#_ToeBase",
    ),
    "MMD": Scheme(
        "全ての親/センター|上半身|上半身2",
        "首|頭",
        "#肩|#腕|(#腕捩)|#ひじ|(#手捩)|#手首",
        "#足|#ひざ|#足首|#つま先",
        ("左", "右"),
    ),
    "DAZ Genesis 8": Scheme(
        _DAZ_TRUNK,
        "neckLower|neckUpper|head",
        "#Collar|#ShldrBend|(#ShldrTwist)|#ForearmBend|(#ForearmTwist)|#Hand",
        "#ThighBend|(#ThighTwist)|#Shin|#Foot|(#Metatarsals)|#Toe",
        ("l", "r"),
    ),
    "DAZ Genesis 9": Scheme(
        "hip|spine1|spine2|spine3|spine4",
        "neck1|neck2|head",
        "#_shoulder|#_upperarm|[#_upperarmtwist1]|#_forearm|[#_forearmtwist1]|#_hand",
        "#_thigh|[#_thightwist1]|#_shin|#_foot|(#_metatarsal)|#_toes",
        ("l", "r"),
    ),
    "Maya HumanIK": Scheme(
        "Reference/Hips|Spine|Spine1|Spine2|Spine3",
        "Neck|Head",
        _MIXAMO_ARM,
        _MIXAMO_LEG,
        _WORDS,
        ("Character1_", ""),
    ),
    "3ds Max Biped": Scheme("/Pelvis|Spine|Spine1|Spine2", "Neck|Head", *_BIPED, around=("Bip001 ", "")),
    "3ds Max CAT": Scheme(
        "Hub001|Spine1|Spine2|Ribcage",
        "Neck1|Head",
        "#ArmCollarbone|#Arm1|#Arm2|#ArmPalm",
        "#Leg1|#Leg2|#LegAnkle|#LegDigit11",
        around=("CATRig", ""),
    ),
    "MotionBuilder": Scheme(
        "Reference/Hips|Spine|Spine1|Spine2|Spine3",
        "Neck|Neck1|Head",
        "#Shoulder|#Arm|[#ArmRoll]|#ForeArm|[#ForeArmRoll]|#Hand",
        "#UpLeg|[#UpLegRoll]|#Leg|[#LegRoll]|#Foot|#ToeBase",
        _WORDS,
    ),
    "iClone": Scheme(
        "RL_BoneRoot/CC_Base_Hip|CC_Base_Waist|CC_Base_Spine01|CC_Base_Spine02",
        "CC_Base_NeckTwist01|CC_Base_NeckTwist02|CC_Base_Head",
        "CC_Base_#_Clavicle|CC_Base_#_Upperarm|CC_Base_#_Forearm|CC_Base_#_Hand",
        "CC_Base_#_Thigh|CC_Base_#_Calf|CC_Base_#_Foot|CC_Base_#_ToeBase",
    ),
    "Character Creator": Scheme(
        "BoneRoot/Hip|Waist|Spine01|Spine02",
        "NeckTwist01|NeckTwist02|Head",
        _CC_ARM,
        _CC_LEG,
        around=("CC_Base_", ""),
    ),
    "AccuRig": Scheme("Hip|Waist|Spine01|Spine02", "NeckTwist01|NeckTwist02|Head", _CC_ARM, _CC_LEG),
    "Xsens": Scheme(
        "Pelvis|L5|L3|T12|T8",
        "Neck|Head",
        "#Shoulder|#UpperArm|#ForeArm|#Hand",
        "#UpperLeg|#LowerLeg|#Foot|#Toe",
        _WORDS,
    ),
    "OptiTrack": Scheme(
        "Hip|Ab|Chest",
        "Neck|Head",
        "#Shoulder|#UArm|#FArm|#Hand",
        "#Thigh|#Shin|#Foot|#Toe",
        around=("Skeleton1_", ""),
    ),
    "Vicon": Scheme(*_VICON, ("l", "r")),
    "Rokoko": Scheme(
        "Hips|Spine1|Spine2|Spine3|Spine4", "Neck|Head", _MIXAMO_ARM, "#Thigh|#Shin|#Foot|#Toe", _WORDS
    ),
    "Azure Kinect": Scheme(
        "PELVIS|SPINE_NAVAL|SPINE_CHEST",
        "NECK|HEAD",
        "CLAVICLE_#|SHOULDER_#|ELBOW_#|WRIST_#",
        "HIP_#|KNEE_#|ANKLE_#|FOOT_#",
        ("LEFT", "RIGHT"),
    ),
    "ARKit": Scheme(
        "root/hips|spine_1|spine_2|spine_3|spine_4|spine_5|spine_6|spine_7",
        "neck_1|neck_2|neck_3|neck_4|head",
        "#_shoulder_1|#_arm|#_forearm|#_hand",
        "#_upLeg|#_leg|#_foot|#_toes",
        ("left", "right"),
        ("", "_joint"),
    ),
    "Source": Scheme(
        "Pelvis|Spine|Spine1|Spine2|Spine4",
        "Neck1|Head1",
        "#_Clavicle|#_UpperArm|#_Forearm|#_Hand",
        "#_Thigh|#_Calf|#_Foot|#_Toe0",
        around=("ValveBiped.Bip01_", ""),
    ),
    "Auto-Rig Pro": Scheme(
        "root.x|spine_01.x|spine_02.x|spine_03.x",
        "neck.x|head.x",
        "shoulder.#|arm_stretch.#|forearm_stretch.#|hand.#",
        "thigh_stretch.#|leg_stretch.#|foot.#|toes_01.#",
        ("l", "r"),
    ),
    "SMPL": Scheme(
        "Pelvis|Spine1|Spine2|Spine3",
        "Neck|Head",
        "#_Collar|#_Shoulder|#_Elbow|#_Wrist",
        "#_Hip|#_Knee|#_Ankle|#_Foot",
    ),
    "H36M": Scheme("Hip|Spine|Thorax", "Neck|Head", "#Shoulder|#Elbow|#Wrist", "#Hip|#Knee|#Foot"),
    "CMU": Scheme(
        "Hips|LowerBack|Spine|Spine1", "Neck|Neck1|Head", _MIXAMO_ARM, f"(#HipJoint)|{_MIXAMO_LEG}", _WORDS
    ),
    "LAFAN1": Scheme(
        "Hips|Spine|Spine1|Spine2", "Neck|Head", _MIXAMO_ARM, "#UpLeg|#Leg|#Foot|#Toe", _WORDS
    ),
    "100STYLE": Scheme(
        "Hips|Chest|Chest2|Chest3|Chest4",
        "Neck|Head",
        "#Collar|#Shoulder|#Elbow|#Wrist",
        "#Hip|#Knee|#Ankle|#Toe",
        _WORDS,
    ),
    "Bandai": Scheme(
        "joint_Root/Hips|Spine|Chest",
        "Neck|Head",
        "Shoulder_#|UpperArm_#|LowerArm_#|Hand_#",
        "UpperLeg_#|LowerLeg_#|Foot_#|Toes_#",
    ),
    "Truebones": Scheme(
        "Hips|Chest|Chest2",
        "Neck|Head",
        "#Collar|#Shoulder|#Elbow|#Wrist",
        "#Hip|#Knee|#Ankle|#Toe",
        _WORDS,
    ),
    "Poser": Scheme(
        "BODY/hip|abdomen|chest",
        "neck|head",
        "#Collar|#Shldr|#ForeArm|#Hand",
        "(#Buttock)|#Thigh|#Shin|#Foot|#Toe",
        ("l", "r"),
    ),
    "Kinect v2": Scheme(
        "SpineBase|SpineMid|SpineShoulder",
        "Neck|Head",
        "Shoulder#|Elbow#|Wrist#",
        "Hip#|Knee#|Ankle#|Foot#",
        _WORDS,
    ),
    "Roblox": Scheme(
        "HumanoidRootPart/LowerTorso|UpperTorso",
        "Head",
        "#UpperArm|#LowerArm|#Hand",
        "#UpperLeg|#LowerLeg|#Foot",
        _WORDS,
    ),
    "Second Life": Scheme(
        "Pelvis|Torso|Chest",
        "Neck|Head",
        "Collar#|Shoulder#|Elbow#|Wrist#",
        "Hip#|Knee#|Ankle#|Foot#",
        _WORDS,
        ("m", ""),
    ),
    "Advanced Skeleton": Scheme(
        "Root_M|Spine1_M|Chest_M",
        "Neck_M|Head_M",
        "Scapula_#|Shoulder_#|Elbow_#|Wrist_#",
        "Hip_#|Knee_#|Ankle_#|Toes_#",
    ),
    "mGear": Scheme(
        "spine_C0_0|spine_C0_1|spine_C0_2",
        "neck_C0_0|neck_C0_head",
        "shoulder_#0_shoulder|arm_#0_0|arm_#0_1|arm_#0_end",
        "leg_#0_0|leg_#0_1|foot_#0_0|foot_#0_1",
        around=("", "_jnt"),
    ),
    "DeepMotion": Scheme(
        "hips|spine|spine1|spine2",
        "neck|head",
        "#_shoulder|#_arm|#_forearm|#_hand",
        "#_upleg|#_leg|#_foot|#_toebase",
        ("l", "r"),
        ("", "_JNT"),
    ),
    "Skyrim": Scheme(
        "Root [Root]/Pelvis [Pelv]|Spine [Spn0]|Spine1 [Spn1]|Spine2 [Spn2]",
        "Neck [Neck]|Head [Head]",
        "# Clavicle [#Clv]|# UpperArm [#Uar]|# Forearm [#Lar]|# Hand [#Hnd]",
        "# Thigh [#Thg]|# Calf [#Clf]|# Foot [#Ft ]|# Toe0 [#Toe]",
        around=("NPC ", ""),
    ),
    "GTA": Scheme(
        "Pelvis|Spine_Root|Spine0|Spine1|Spine2|Spine3",
        "Neck_1|Head",
        "#_Clavicle|#_UpperArm|#_Forearm|#_Hand",
        "#_Thigh|#_Calf|#_Foot|#_Toe0",
        around=("SKEL_", ""),
    ),
    "XNALara": Scheme(
        "root hips|spine lower|spine middle|spine upper",
        "head neck lower|head neck upper",
        "arm # shoulder 1|arm # shoulder 2|arm # elbow|arm # wrist",
        "leg # thigh|leg # knee|leg # ankle|leg # toes",
        ("left", "right"),
    ),
    "Fallout": Scheme(
        "COM|SPINE1|SPINE2|Chest",
        "Neck|HEAD",
        "#Arm_Collarbone|#Arm_UpperArm|#Arm_ForeArm1|#Arm_Hand",
        "#Leg_Thigh|#Leg_Calf|#Leg_Foot|#Leg_Toe1",
    ),
    "MediaPipe": Scheme(
        "pelvis|torso", "neck|head", "#_shoulder|#_elbow|#_wrist", "#_hip|#_knee|#_ankle", ("left", "right")
    ),
    "iPi": Scheme(
        "Hip|LowerSpine|MiddleSpine|Chest",
        "Neck|Head",
        "#Clavicle|#Shoulder|#Forearm|#Hand",
        "#Thigh|#Shin|#Foot|#Toe",
    ),
    "Cascadeur": Scheme(
        "pelvis|stomach|chest",
        "neck|head",
        "clavicle_#|arm_#|forearm_#|hand_#",
        "thigh_#|calf_#|foot_#|toe_#",
        ("l", "r"),
    ),
    "Sims": Scheme(
        "ROOT/Pelvis__|Spine0__|Spine1__|Spine2__",
        "Neck__|Head__",
        "#_Clavicle__|#_UpperArm__|#_Forearm__|#_Hand__",
        "#_Thigh__|#_Calf__|#_Foot__|#_Toe__",
        around=("b__", ""),
    ),
    "BVH description": Scheme(
        "Hips|Chest", "Neck|Head", "#Collar|#UpArm|#LowArm|#Hand", "#UpLeg|#LowLeg|#Foot", _WORDS
    ),
    "German": Scheme(
        "Becken|Wirbelsäule|Brust",
        "Hals|Kopf",
        "Schulter.#|Oberarm.#|Unterarm.#|Hand.#",
        "Oberschenkel.#|Unterschenkel.#|Fuß.#|Zehen.#",
    ),
    "French": Scheme(
        "Bassin|Colonne|Poitrine",
        "Cou|Tête",
        "Épaule_#|Bras_#|Avant-bras_#|Main_#",
        "Cuisse_#|Mollet_#|Pied_#|Orteils_#",
        ("Gauche", "Droite"),
    ),
    "Spanish": Scheme(
        "Cadera|Columna|Pecho",
        "Cuello|Cabeza",
        "Hombro_#|Brazo_#|Antebrazo_#|Mano_#",
        "Muslo_#|Pantorrilla_#|Pie_#|Punta_#",
        ("Izq", "Der"),
    ),
    "French, letters": Scheme(
        "Bassin|Torse",
        "Cou|Tete",
        "Epaule.#|Bras.#|AvantBras.#|Main.#",
        "Cuisse.#|Jambe.#|Pied.#|Orteils.#",
        ("G", "D"),
    ),
    "MMD in Blender": Scheme(
        "センター|上半身|上半身2",
        "首|頭",
        "肩.#|腕.#|(腕捩.#)|ひじ.#|(手捩.#)|手首.#",
        "足.#|ひざ.#|足首.#|つま先.#",
    ),
    "Nuitrack": Scheme(
        "waist|torso|collar",
        "neck|head",
        "#_shoulder|#_elbow|#_wrist",
        "#_hip|#_knee|#_ankle",
        ("left", "right"),
    ),
    "Cinema 4D": Scheme(
        "Hip|Spine|Chest",
        "Neck|Head",
        "#_Shoulder|#_Arm_Upper|#_Arm_Lower|#_Hand",
        "#_Leg_Upper|#_Leg_Lower|#_Foot|#_Toes",
    ),
    "OpenPose": Scheme("MidHip", "Neck|Head", "#Shoulder|#Elbow|#Wrist", "#Hip|#Knee|#Ankle|#BigToe"),
    "Chinese": Scheme(
        "骨盆|脊椎|胸", "颈|头", "#肩|#上臂|#前臂|#手", "#大腿|#小腿|#脚|#脚趾", ("左", "右")
    ),
    "Cyrillic": Scheme(
        "Таз|Спина|Грудь",
        "Шея|Голова",
        "Плечо.#|Рука.#|Предплечье.#|Кисть.#",
        "Бедро.#|Голень.#|Стопа.#|Носок.#",
    ),
    "MakeHuman": Scheme(
        "root|spine05|spine04|spine03|spine02|spine01",
        "neck01|neck02|neck03|head",
        "clavicle.#|(shoulder01.#)|upperarm01.#|(upperarm02.#)|lowerarm01.#|(lowerarm02.#)|wrist.#",
        "(pelvis.#)|upperleg01.#|(upperleg02.#)|lowerleg01.#|(lowerleg02.#)|foot.#|toe1-1.#",
    ),
    "Kinect v1": Scheme(
        "HipCenter|Spine|ShoulderCenter",
        "Head",
        "Shoulder#|Elbow#|Wrist#",
        "Hip#|Knee#|Ankle#|Foot#",
        _WORDS,
    ),
    "NITE": Scheme(
        "WAIST|TORSO",
        "NECK|HEAD",
        "#_COLLAR|#_SHOULDER|#_ELBOW|#_HAND",
        "#_HIP|#_KNEE|#_FOOT",
        ("LEFT", "RIGHT"),
        ("SKEL_", ""),
    ),
    "mocopi": Scheme(
        "root|torso_1|torso_2|torso_3|torso_4|torso_5|torso_6|torso_7",
        "neck_1|neck_2|head",
        "#_shoulder|#_up_arm|#_low_arm|#_hand",
        "#_up_leg|#_low_leg|#_foot|#_toes",
        ("l", "r"),
    ),
    "SMPL-X": Scheme(
        "pelvis|spine1|spine2|spine3",
        "neck|head",
        "#_collar|#_shoulder|#_elbow|#_wrist",
        "#_hip|#_knee|#_ankle|#_foot",
        ("left", "right"),
    ),
    "Nintendo": Scheme(
        "Skl_Root/Waist|Spine_1|Spine_2",
        "Neck|Head",
        "Clavicle_#|Arm_1_#|Arm_2_#|Wrist_#",
        "Leg_1_#|Leg_2_#|Ankle_#|Toe_#",
    ),
    "Smash Ultimate": Scheme(
        "Trans|Rot/Hip|Waist|Bust", "Neck|Head", "Clavicle#|Shoulder#|Arm#|Hand#", "Leg#|Knee#|Foot#|Toe#"
    ),
    "Source 2": Scheme(
        "pelvis|spine_0|spine_1|spine_2|spine_3",
        "neck_0|head_0",
        "clavicle_#|arm_upper_#|arm_lower_#|hand_#",
        "leg_upper_#|leg_lower_#|ankle_#|ball_#",
    ),
    "Second Life Bento": Scheme(
        "Pelvis|Spine1|Spine2|Torso|Spine3|Spine4|Chest",
        "Neck|Head",
        "Collar#|Shoulder#|Elbow#|Wrist#",
        "Hip#|Knee#|Ankle#|Foot#",
        _WORDS,
        ("m", ""),
    ),
    "VRChat": Scheme(
        "Hips|Spine|Chest",
        "Neck|Head",
        "# shoulder|# arm|# elbow|# wrist",
        "# leg|# knee|# ankle|# toe",
        _WORDS,
    ),
    "RE Engine": Scheme(
        "root/hips|spine_0|spine_1|spine_2",
        "neck_0|neck_1|head",
        "#_arm_clavicle|#_arm_humerus|#_arm_radius|#_arm_wrist",
        "#_leg_femur|#_leg_tibia|#_leg_ankle|#_leg_ball",
        ("l", "r"),
    ),
    "Call of Duty": Scheme(
        "j_mainroot|j_spinelower|j_spineupper|j_spine4",
        "j_neck|j_head",
        "j_clavicle_#|j_shoulder_#|j_elbow_#|j_wrist_#",
        "j_hip_#|j_knee_#|j_ankle_#|j_ball_#",
        ("le", "ri"),
    ),
    "CloudRig": Scheme(
        "DEF-Hips|DEF-Spine|DEF-RibCage|DEF-Chest",
        "DEF-Neck|DEF-Head",
        "DEF-Clavicle.#|DEF-UpperArm1.#|(DEF-UpperArm2.#)|DEF-Forearm1.#|(DEF-Forearm2.#)|DEF-Wrist.#",
        "DEF-Thigh1.#|(DEF-Thigh2.#)|DEF-Knee1.#|(DEF-Knee2.#)|DEF-Foot.#|DEF-Toes.#",
    ),
    "Rapid Rig": Scheme(
        "root|spine_01|spine_02|chest",
        "neck|head",
        "#_clav|#_upArm|#_loArm|#_hand",
        "#_upLeg|#_loLeg|#_foot|#_toe",
        ("l", "r"),
        ("", "_bind_jnt"),
    ),
    "Theia3D": Scheme(
        "worldbody/pelvis|abdomen|torso",
        "neck|head",
        "#_uarm|#_larm|#_hand",
        "#_thigh|#_shank|#_foot|#_toes",
        ("l", "r"),
    ),
    "OpenSim": Scheme(
        "ground/pelvis|torso",
        "head",
        "humerus_#|ulna_#|hand_#",
        "femur_#|tibia_#|talus_#|toes_#",
        ("l", "r"),
    ),
    "Ghoul2": Scheme(
        "model_root/pelvis|lower_lumbar|upper_lumbar|thoracic",
        "cervical|cranium",
        "#clavical|#humerus|#radius|#hand",
        "#femurYZ|#tibia|#talus",
        ("l", "r"),
    ),
    "Quaternius": Scheme(
        "Body/Hips|Abdomen|Torso",
        "Neck|Head",
        "Shoulder.#|UpperArm.#|LowerArm.#|Palm.#",
        "UpperLeg.#|LowerLeg.#|Foot.#",
    ),
    "Numbers behind sides": Scheme(
        "Hips|Spine1|Spine2", "Neck|Head", "#_Arm_01|#_Arm_02|#_Arm_03", "#_Leg_01|#_Leg_02|#_Leg_03"
    ),
    "Numbers from 0": Scheme(
        "pelvis|spine0|spine1",
        "neck|head",
        "#Clavicle|#Arm0|#Arm1|#Arm2",
        "#Leg0|#Leg1|#Leg2|#Leg3",
        ("l", "r"),
    ),
    "Meta XR": Scheme(
        "FullBody_Root/FullBody_Hips|FullBody_SpineLower|FullBody_SpineMiddle|FullBody_SpineUpper|FullBody_Chest",
        "FullBody_Neck|FullBody_Head",
        "FullBody_#Shoulder|(FullBody_#Scapula)|FullBody_#ArmUpper|FullBody_#ArmLower|(FullBody_#HandWristTwist)|FullBody_#HandWrist",
        "FullBody_#UpperLeg|FullBody_#LowerLeg|(FullBody_#FootAnkleTwist)|FullBody_#FootAnkle|(FullBody_#FootSubtalar)|FullBody_#FootBall",
        _WORDS,
    ),
    "Momentum": Scheme(
        "body_world/root|c_spine0|c_spine1|c_spine2|c_spine3",
        "c_neck|c_head",
        "#_clavicle|#_uparm|#_lowarm|(#_wrist_twist)|#_wrist",
        "#_upleg|#_lowleg|#_foot|#_ball",
        ("l", "r"),
    ),
    "Meta Avatars": Scheme(
        "b_root|b_spine0|b_spine1|b_spine2|b_spine3",
        "b_neck0|b_head",
        "b_#_shoulder|b_#_arm|b_#_forearm|b_#_hand",
        "b_#_upleg|b_#_leg|b_#_foot|b_#_toe",
        ("l", "r"),
    ),
    "Hive": Scheme(
        "god_M_root_jnt/spine_M_hips_jnt|spine_M_spine0_jnt|spine_M_spine1_jnt",
        "head_M_neck_jnt|head_M_head_jnt",
        "arm_#_clavicle_jnt|arm_#_upperarm_jnt|arm_#_lowerarm_jnt|arm_#_wrist_jnt",
        "leg_#_upperleg_jnt|leg_#_lowerleg_jnt|leg_#_foot_jnt|leg_#_ball_jnt",
    ),
    "Lightwave": Scheme(
        "Hip|Spine1|Spine2|Chest",
        "Neck|Head",
        "Shoulder_#|BiCep_#|ForeArm_#|Hand_#",
        "Thigh_#|Shin_#|Foot_#|Toes_#",
    ),
    "Italian": Scheme(
        "Bacino|Colonna|Torace",
        "Collo|Testa",
        "Spalla_#|Braccio_#|Avambraccio_#|Mano_#",
        "Coscia_#|Gamba_#|Piede_#|Dita_#",
        ("Sx", "Dx"),
    ),
    "Portuguese": Scheme(
        "Quadril|Coluna|Peito",
        "Pescoço|Cabeça",
        "Ombro_#|Braço_#|Antebraço_#|Mão_#",
        "Coxa_#|Perna_#|Pé_#|Dedos_#",
        ("Esq", "Dir"),
    ),
    "Dutch": Scheme(
        "Bekken|Ruggengraat|Borst",
        "Nek|Hoofd",
        "Schouder_#|Bovenarm_#|Onderarm_#|Hand_#",
        "Bovenbeen_#|Onderbeen_#|Voet_#|Tenen_#",
        ("L", "R"),
    ),
    "NTU RGB+D": Scheme(
        "base of spine|middle of spine|spine",
        "neck|head",
        "# shoulder|# elbow|# wrist",
        "# hip|# knee|# ankle|# foot",
        ("left", "right"),
    ),
    "AIST++": Scheme(
        "root|belly|lowerback|upperback",
        "neck|head",
        "#inshoulder|#shoulder|#elbow|#wrist",
        "#hip|#knee|#ankle|#toe",
        ("l", "r"),
    ),
    "Acclaim": Scheme(
        "root|lowerback|upperback|thorax",
        "lowerneck|upperneck|head",
        "#clavicle|#humerus|#radius|#hand",
        "(#hipjoint)|#femur|#tibia|#foot|#toes",
        ("l", "r"),
    ),
    "Anatomy in words": Scheme(
        "hips|waist|stomach|ribs",
        "neck|head",
        "clavicle_#|bicep_#|forearm_#|wrist_#",
        "thigh_#|knee_#|ankle_#|toe_#",
    ),
}
"""Scheme -> names."""
