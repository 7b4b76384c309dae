"""What to look at in a retargeted motion, told from the source alone: no reference is needed.

``verdict`` compares a result with its source and lists frames, each with its reason:

- ``snap``: a knee or elbow turns much faster than the source's;
- ``straight``: it is stretched where the source's is bent;
- ``speed``: a joint moves much faster than the source's would on this body;
- ``floor``: a foot is below the floor that the source stands on;
- ``slide``: a foot slides while the source's stands;
- ``inside``: a hand is in the body, where the result's character has a mesh.

Bones that nothing drives (capes, hair, props, twist joints) follow their parent; they are named, and are no
errors. The limits stand at the top of each module.
"""

from retarget_bench.verification.verdict.defects import Defect, Verdict
from retarget_bench.verification.verdict.judging import verdict

__all__ = ["Defect", "Verdict", "verdict"]
