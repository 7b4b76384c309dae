"""One performance by one body: inverse kinematics in closed form, over all frames at once.

What a performer does is passed over a fixed number of times, each time corrected by what the last pose
lacked; nothing stops early, and no choice is made between near equals, so results do not depend on a
machine's last digits.
"""

from ..bodies.structures import Body
from ..performances.score import DogScore, Score
from .dogs import Dog, DogManner
from .people import Manner, Person
from .pose import Solution


def solve(score: Score, body: Body, manner: Manner | DogManner | None = None) -> Solution:
    """The performance of ``score`` by ``body``, in the usual manner or another one of its kind."""
    performer: Person | Dog
    if isinstance(score, DogScore):
        assert not isinstance(manner, Manner)
        performer = Dog(score, body, manner or DogManner())
    else:
        assert not isinstance(manner, DogManner)
        performer = Person(score, body, manner or Manner())
    pose = performer.pose()
    for _ in range(performer.passes - 1):
        performer.adjust(pose)
        pose = performer.pose()
    return pose.solution(*performer.contacts)
