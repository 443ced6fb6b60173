"""Trees of joints that hypothesis draws, and some with many joints that are always tried."""

from hypothesis import HealthCheck, example, settings
from hypothesis import strategies as st

from plumbob.reference.articulation import KINDS

TREES = {
    "kinds": st.lists(st.sampled_from(KINDS), min_size=1, max_size=6),
    "seed": st.integers(0, 2**32 - 1),
}
EXAMPLES = (
    example(kinds=["ball", "hinge", "slide", "ball", "free", "hinge"], seed=1),
    example(kinds=["hinge", "hinge", "ball", "slide", "hinge", "ball"], seed=2),
    example(kinds=["slide", "ball", "hinge", "hinge", "fixed", "ball"], seed=3),
    example(kinds=["hinge", "slide", "hinge", "slide", "hinge", "hinge"], seed=4),
)


def with_examples(law):
    """Add trees of many joints to those that are drawn, of which the first are small."""
    for one in EXAMPLES:
        law = one(law)
    return law


def drawn(**more):
    """Return settings of hypothesis with which fixtures may serve all examples of a law."""
    return settings(suppress_health_check=[HealthCheck.function_scoped_fixture], **more)
