"""Forward and backward reaching (Aristidou & Lasenby 2011, Algorithm 1)."""

from ..quaternion import add, norm, put_vector, scale, subtract, vector_at
from .chain import in_hole, out_of_reach, root_distance


def fabrik_sweep(chain, target):
    """Move the joints' positions: to the target and back to the root, or, beyond reach, on a line.

    Only positions move; the links are turned after the last sweep.
    """
    d = root_distance(chain, target)
    if out_of_reach(chain, d):
        lay_on_line(chain, target, 1.0)
    elif in_hole(chain, d):
        lay_on_line(chain, target, -1.0)
    else:
        reach_backward(chain, target)
        reach_forward(chain)


def reach_backward(chain, target):
    """Put the effector on the target and pull the joints after it, up to the root."""
    put_vector(chain.positions, len(chain.lengths), target)
    for k in range(len(chain.lengths) - 1, -1, -1):
        after = vector_at(chain.positions, k + 1)
        pulled = place_towards(after, vector_at(chain.positions, k), chain.lengths[k])
        put_vector(chain.positions, k, pulled)


def reach_forward(chain):
    """Put the root back and pull the joints after it, down to the effector."""
    put_vector(chain.positions, 0, vector_at(chain.offsets, 0))
    for k in range(len(chain.lengths)):
        before = vector_at(chain.positions, k)
        pulled = place_towards(before, vector_at(chain.positions, k + 1), chain.lengths[k])
        put_vector(chain.positions, k + 1, pulled)


def lay_on_line(chain, target, others):
    """Lay the longest link towards the target and the others towards it (1) or back (-1).

    Beyond reach all point at the target; inside the hole that the longest link leaves all others
    fold back, and the effector comes to rest on the rim.
    """
    root = vector_at(chain.positions, 0)
    towards = subtract(place_towards(root, target, 1.0), root)
    found = False
    for k in range(len(chain.lengths)):
        longest = chain.lengths[k] == chain.longest and not found
        found |= longest
        step = scale(chain.lengths[k] if longest else others * chain.lengths[k], towards)
        put_vector(chain.positions, k + 1, add(vector_at(chain.positions, k), step))


def place_towards(start, end, length):
    """Return the point at a distance from start in the direction of end, of x if they coincide."""
    way = subtract(end, start)
    distance = norm(way)
    if distance == 0.0:
        return add(start, (length, 0.0, 0.0))
    return add(start, scale(length / distance, way))
