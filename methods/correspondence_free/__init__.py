"""Correspondence-free retargeting: points of a moving body in, the vertices of another one out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, PointSets, Source, Surface
from retarget_bench.errors import NotSupported
from retarget_bench.files import digest
from retarget_bench.motion import rates, root_rules
from retarget_bench.motion.character import Character
from retarget_bench.training.learned_method import of_weights

from .online import Networks, OnlineRetargeter, estimated_body
from .posing import into_t_pose


@dataclass(eq=False)
class CorrespondenceFree(Method):
    """The pipeline of Marsot, Rekik et al. (HAL v1, 2023): SKR, SMRM and SKIN.

    1. SKR finds 22 joints in every frame's points, and in points drawn from the target's mesh in T-pose.
    2. SMRM carries their motion to the target's joints, frame by frame.
    3. SKIN gives every vertex of the target shares of the joints, and linear blend skinning moves it.

    The source is points without order or correspondence. Of the target the mesh is used, and neither
    skeleton nor skinning weights. A mesh in another pose is brought into the T-pose first (``posing.py``).

    The size of the source, by which SMRM measures lengths, is its legs', by all frames so far. Nothing
    looks ahead, and nothing is smoothed. Other rates than 30 frames per second are met between the
    joints' places, and answered between the target's rotations.

    skr, smrm, skin: names of the stages' weights, or paths to others; each stage has the parameters that
    its weights were trained with. path: see SMRM. views: see SKR.
    """

    skr: str = "puppets"
    smrm: str = "puppets"
    skin: str = "puppets"
    path: root_rules.PathKind = "relative"
    views: int = 4

    card = MethodCard(
        name="correspondence_free",
        title="Correspondence-free",
        summary="Points of a surface to a target's mesh: joints by SKR, motion by SMRM, skin by SKIN",
        version="1",
        paper="Marsot, Rekik et al., Correspondence-free online human motion retargeting, HAL v1, 2023. "
        "The code that the authors published (human-motion-retargeting2023, arXiv 2302.00556 v2) replaces "
        "the skinning stage and is not what the first version describes",
        published=({"path": "integrated", "views": 1},),
        differs={"path": "path relative to the source's", "views": "the mean of four views of the points"},
        accepts=("points",),
        tasks=("points",),
        parameters={
            "skr": "weights of skr: name of shipped ones, or a path",
            "smrm": "weights of smrm: name of shipped ones, or a path",
            "skin": "weights of skin: name of shipped ones, or a path",
            "views": "1, 2 or 4: skr shares points out to see them as they are, turned and mirrored",
            "path": "integrated (moves summed up) or relative (the source's, scaled; what differs fades)",
        },
    )

    @cached_property
    def networks(self) -> Networks:
        """The three stages."""
        return Networks(
            skr=of_weights("skr", self.skr, views=self.views),
            smrm=of_weights("smrm", self.smrm, path=self.path),
            skin=of_weights("skin", self.skin, skr=self.skr),
        )

    @property
    def stages(self) -> Mapping[str, Any]:
        """The three methods, by name."""
        return vars(self.networks)

    @property
    def untrained(self) -> str:
        """Reason why a stage cannot answer as it is; "" where all can."""
        return next((each.untrained for each in self.stages.values() if each.untrained), "")

    @property
    def weights_hash(self) -> str:
        """The hash of the three stages' weights together; "" where one has none."""
        each = [stage.weights_hash for stage in self.stages.values()]
        return digest(" ".join(each)) if all(each) else ""

    @property
    def training_manifest(self) -> Mapping[str, Sequence[str]] | None:
        """The training data of all three stages; None where one has no manifest."""
        each = [stage.training_manifest for stage in self.stages.values()]
        manifests = [manifest for manifest in each if manifest is not None]
        if len(manifests) < len(each):
            return None
        kinds = sorted({kind for manifest in manifests for kind in manifest})
        return {
            kind: sorted({name for manifest in manifests for name in manifest.get(kind, ())})
            for kind in kinds
        }

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if self.untrained:
            return self.untrained
        if target.skin is None:
            return f"{target.name} has no mesh to move"
        if target.four_legged:
            return f"{target.name} stands on four legs, and correspondence_free knows bodies with two"
        return None

    def retarget(self, source: Source, target: Character, *, context: Context) -> Surface:
        if not isinstance(source, PointSets):
            raise NotSupported("correspondence_free needs points on the source's surface")
        online = self.online(target)
        joints = self.networks.skr.joints(source.points)
        places = estimated_body(joints[0]).positions(joints, source.fps)
        motion = online.motion(rates.at_thirty(places).positions)
        vertices = online.mesh.skinned(rates.back(motion, places))
        return replace(target.surface(vertices, source.fps), notes=online.notes)

    def online(self, target: Character) -> OnlineRetargeter:
        """A retargeter from a source to a target frame by frame, at the source's first frame.

        Raises NotSupported where the pose of the target's mesh is not known.
        """
        mesh = target.mesh
        assert mesh is not None, f"{target.name} was found unfit"
        vertices, notes = into_t_pose(self.networks, np.asarray(mesh.vertices), mesh.faces)
        return OnlineRetargeter(self.networks, vertices, mesh.faces, notes)


plugin = CorrespondenceFree
