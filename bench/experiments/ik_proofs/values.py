"""The records of proofs for the poses of a robot."""

from ...harness.values import Booleans1, Floats1, Integers1, Values


class ProofWords(Values, frozen=True, kw_only=True):
    """The group of the robot, the kind of its targets, and the tolerances [m], [rad]."""

    group: str
    targets: str
    tolerance: float
    restarts: int


class PoseProofs(ProofWords, frozen=True):
    """What is proven about the answers to targets, (target,)."""

    converged: Booleans1  # whether the solver says that it has reached the target
    reached: Booleans1  # whether that is proven
    coverage: Integers1  # of the certificates
    distance: Floats1  # to an exact solution, at most [rad]; infinite without a proof
    least_distance: Floats1  # of every pose [m]; 0 without a proof
    refuted: Booleans1  # whether the answer is nearer than every pose is proven to be
    seconds: Floats1  # of the proof
    setup: float  # of the shells of the robot [s]


KINDS = {"": PoseProofs}
