"""Is built, supports everything, and fails at work."""

from types import SimpleNamespace


class plugin:
    card = SimpleNamespace(name="crashes", summary="", version="1", default=False)

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        raise ZeroDivisionError("a bone of length 0")
