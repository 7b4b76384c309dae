"""The code in the other Python, with plain arrays; docs/plugins.md tells what is in them."""


def retarget(source: dict, target: dict, context: dict) -> dict:
    """The motion of the target: as many frames as the source."""
    del context  # seed, device, parameters
    if source["body"]["names"] != target["names"]:
        raise NotImplementedError("the bodies have different joints")
    return {"rotations": source["rotations"], "root": source["root"]}
