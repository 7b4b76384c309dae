"""One line that says what the method does; bench list shows it."""

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion


class MyMethod(Method):
    """Copies the pose, and lets the character take longer or shorter steps."""

    card = MethodCard(
        name="my_method",
        summary="The copied pose with longer or shorter steps",
        version="1",
        parameters={"stride": "how long the steps are, 1 being as long as the legs ask for"},
        # with weights from elsewhere, so that tables can tell what it has seen, and results what it was
        # (docs/examples/learned_pose.py is a beginning for bench train):
        # trained_on={"characters": ("amy", "joe"), "structures": ("body22",), "clips": ("walk",)},
        # assets={"network.npz": Asset("the weights")},  # then asset_path(self, "network.npz") is the file
    )

    def __init__(self, stride: float = 1.0) -> None:
        self.stride = stride

    def supports(self, source: Character, target: Character) -> str | None:
        """None where this pair can be retargeted, else the reason why not."""
        return transfer.reason(source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        """The motion of the target: as many frames as the source, at its rate.

        source.rotations (frames, joints, 4) are local unit quaternions, w first; source.root (frames, 3)
        and source.positions (frames, joints, 3) are metres, Y up; source.character and target know their
        skeleton, roles and measures. context.seed is the only randomness a method may use.
        """
        del context
        if not isinstance(source, Motion):
            raise NotSupported("my_method needs a source with rotations")
        copied = transfer.carry(source, target, "hip_height")
        root = copied.root.copy()
        root[:, [0, 2]] *= self.stride
        return target.motion(copied.rotations, root, source.fps)


plugin = MyMethod
