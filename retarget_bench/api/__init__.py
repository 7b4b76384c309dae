"""The contracts between the engine and its plug-ins. Read this first.

The contracts are base classes, each with what its plug-ins must have (abstract) and what they may have,
with its default. To derive from them is an offer: a plug-in may import nothing from here, and is completed
where the engine takes it in (``complete``). A plug-in is a callable, mostly a class, that takes its
parameters as keywords and returns such an object; in a file it is the module's attribute ``plugin``.

The one path: a Dataset gives Cases; a Method turns a case's source motion into a motion of the target;
a Metric compares that prediction with the case and returns named numbers.

Imports motion.
Offers ``cases``, ``datasets``, ``methods``, ``metrics`` and what metrics see (``comparison``).
"""

from retarget_bench.api.cases import PAIRED as PAIRED
from retarget_bench.api.cases import TASKS as TASKS
from retarget_bench.api.cases import Case as Case
from retarget_bench.api.cases import CaseInfo as CaseInfo
from retarget_bench.api.cases import Contacts as Contacts
from retarget_bench.api.cases import Performed as Performed
from retarget_bench.api.cases import Touch as Touch
from retarget_bench.api.cases import TrainingPair as TrainingPair
from retarget_bench.api.comparison import Comparison as Comparison
from retarget_bench.api.comparison import ContactLabels as ContactLabels
from retarget_bench.api.datasets import CROSS as CROSS
from retarget_bench.api.datasets import INTRA as INTRA
from retarget_bench.api.datasets import SELF as SELF
from retarget_bench.api.datasets import SPLITS as SPLITS
from retarget_bench.api.datasets import Dataset as Dataset
from retarget_bench.api.datasets import DatasetCard as DatasetCard
from retarget_bench.api.datasets import TrainingClips as TrainingClips
from retarget_bench.api.datasets import Unreadable as Unreadable
from retarget_bench.api.methods import Ablation as Ablation
from retarget_bench.api.methods import Asset as Asset
from retarget_bench.api.methods import Context as Context
from retarget_bench.api.methods import Method as Method
from retarget_bench.api.methods import MethodCard as MethodCard
from retarget_bench.api.methods import Parameters as Parameters
from retarget_bench.api.methods import TrainingShare as TrainingShare
from retarget_bench.api.metrics import TWO_LEGS as TWO_LEGS
from retarget_bench.api.metrics import AnyMetric as AnyMetric
from retarget_bench.api.metrics import CaseFeatures as CaseFeatures
from retarget_bench.api.metrics import Direction as Direction
from retarget_bench.api.metrics import Metric as Metric
from retarget_bench.api.metrics import MetricCard as MetricCard
from retarget_bench.api.metrics import PairMetric as PairMetric
from retarget_bench.api.metrics import Sample as Sample
from retarget_bench.api.metrics import SetMetric as SetMetric
from retarget_bench.api.metrics import Stretches as Stretches
from retarget_bench.api.metrics import Value as Value
from retarget_bench.api.metrics import against_source as against_source
from retarget_bench.api.metrics import protocol as protocol
from retarget_bench.motion.ground import Ground as Ground
from retarget_bench.motion.motion import Motion as Motion
from retarget_bench.motion.motion import PointSets as PointSets
from retarget_bench.motion.motion import Prediction as Prediction
from retarget_bench.motion.motion import Source as Source
from retarget_bench.motion.motion import Surface as Surface
