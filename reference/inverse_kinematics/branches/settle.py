"""From candidates to solutions: Newton's method, limits, forward kinematics, no duplicates."""

import math

from ...articulation import HINGE, LIMIT_TOLERANCE
from ...backend.compiled import Kernel
from ..bounded_step import FULL_CIRCLE, fill_errors, fill_jacobian, new_system, solve_system
from ..linear_algebra import clear, inner
from ..mechanism import Mechanism, errors, new_data, update_forward_kinematics
from ..restarts import copy_row
from ..solve_mechanism import normalise_target
from .closed_forms import ARM, HINGES, fill_candidates
from .subproblems import CERTAIN, DOUBTFUL

# A solution reaches its target within this, over the reach, and this angle [rad]. Of 2,098
# solutions for 300 poses of a UR5 the worst is off by 2.4e-14.
TOLERANCE = 1e-9
# Solutions are the same if their coordinates differ by no more, over the reach for slides. The
# nearest two of these solutions are 1.3e-3 rad apart; near a double root a rounding of 1e-14 parts
# copies by 1e-7.
DUPLICATE = 1e-6
# A candidate this near to the target or a limit may or may not be a solution: near a double root,
# rounding by e moves the root by sqrt(e).
IN_DOUBT = 1e-6
# Errors below this, over the reach, are rounding of the forward kinematics: some ten for each of
# six joints.
ROUNDING = 64 * 2.220446049250313e-16
# Where the number of roots is certain, none are nearly double: a candidate this near to the target
# is a solution to more digits than promised. Axes of robot files meet to 1e-12.
SETTLED = 1e-3 * TOLERANCE
# A candidate this far beyond its limits, over the reach or [rad], does not come back: the polish
# moves by far less. A smaller number would only save time.
BEYOND_RETURN = 0.1
# Steps of Newton's method; closed forms need none or a single step. Near a double root a step
# halves the error and quarters the residual: twelve divide the residual by 1.7e7.
NEWTON_STEPS = 12


def solve_closed_form(block):
    """Fill the solutions of an arm; return their number, -1 for an invalid target, and its status.

    The arm comes as a block of floats, which is passed to a kernel faster than a record.
    """
    arm = block.view(ARM)[0]
    target = arm["target"]
    if not normalise_target(target):
        return -1, CERTAIN
    mechanism = Mechanism(
        arm["joints"], arm["columns"], arm["effectors"], arm["moves"], arm["adjacent"],
        arm["reach"], HINGES, HINGES,
    )  # fmt: skip
    candidates = arm["candidates"][: fill_candidates(arm)]
    near = SETTLED if arm["status"][0] == CERTAIN else ROUNDING
    count, doubts = settle(mechanism, target, candidates, arm["solutions"], near)
    return count, max(arm["status"][0], min(doubts, DOUBTFUL))


def settle_candidates(mechanism_fields, candidates, target, rows):
    """Fill the solutions among candidates; return their number and that of doubtful candidates."""
    return settle(Mechanism(*mechanism_fields), target, candidates, rows, ROUNDING)


def settle(mechanism, target, candidates, rows, near):
    """Fill the solutions among candidates; those `near` the target within limits need no polish."""
    data, system = new_data(mechanism), new_system(mechanism.equations, mechanism.freedoms)
    clear(system.active)
    count, doubts, reach, width = 0, 0, mechanism.reach, len(data.q)
    for i in range(len(candidates)):
        copy_row(candidates[i], data.q)
        gap = bring_within_limits(mechanism.joints, data.q, reach)
        if gap > BEYOND_RETURN:
            continue
        update_forward_kinematics(mechanism, data)
        distance, angle = errors(mechanism, target, data, 0)
        if not (distance <= near * reach and angle <= near and gap <= 0.0):
            polish(mechanism, target, data, system)
            gap = bring_within_limits(mechanism.joints, data.q, reach)
            if gap > 0.0:
                update_forward_kinematics(mechanism, data)
            distance, angle = errors(mechanism, target, data, 0)
        if not (distance <= TOLERANCE * reach and angle <= TOLERANCE and gap <= LIMIT_TOLERANCE):
            doubts += max(distance / reach, angle, gap) <= IN_DOUBT
            continue
        k = 0
        while k < count and not is_same(mechanism.joints, rows[k], data.q, reach):
            k += 1
        if k == count:
            copy_row(data.q, rows[k])
            rows[k, width], rows[k, width + 1], rows[k, width + 2] = distance, angle, 0.0
            count += 1
        rows[k, width + 2] += 1.0
    return count, doubts


def polish(mechanism, target, data, system):
    """Improve coordinates by Newton's method while steps help; see `TaskSystem` for the errors."""
    fill_errors(mechanism, target, data, system.e)
    square, rounding = inner(system.e, system.e), ROUNDING * mechanism.reach
    for _ in range(NEWTON_STEPS):
        if square <= rounding * rounding:
            break
        fill_jacobian(mechanism, target, data, system.J)
        solve_system(system, 0.0)
        for k in range(len(system.step)):
            system.step[k] = inner(system.J[k], system.z)
        move(mechanism, data, system.step, 1.0)
        fill_errors(mechanism, target, data, system.e)
        before, square = square, inner(system.e, system.e)
        if not square < before:
            move(mechanism, data, system.step, -1.0)
            break


def move(mechanism, data, step, share):
    """Change the coordinates by a share of a step; slides count lengths over the reach."""
    joints = mechanism.joints
    for j in range(len(joints)):
        if joints["leader"][j] == j:
            unit = 1.0 if joints["kind"][j] == HINGE else mechanism.reach
            data.q[joints["coordinate"][j]] += share * unit * step[joints["freedom"][j]]
    update_forward_kinematics(mechanism, data)


def bring_within_limits(joints, q, reach):
    """Bring angles within limits, as near to the middle as whole revolutions do; return the excess.

    A joint with followers keeps its angle, as a revolution would not bring the followers around.
    The excess is how far beyond a limit some coordinate is, lengths over the reach.
    """
    gap = 0.0
    for j in range(len(joints)):
        if joints["leader"][j] == j:
            lower, upper, at = joints["lower"][j], joints["upper"][j], joints["coordinate"][j]
            unit = reach
            if joints["kind"][j] == HINGE:
                if not joints["followed"][j]:
                    q[at] -= FULL_CIRCLE * round((q[at] - middle(lower, upper)) / FULL_CIRCLE)
                unit = 1.0
            excess = max(lower - q[at], q[at] - upper) / unit
            gap = max(gap, excess)
            if excess <= LIMIT_TOLERANCE:
                q[at] = min(max(q[at], lower), upper)
    return gap


def middle(lower, upper):
    """Return the middle of limits; without a limit the range is a revolution."""
    if lower == -math.inf:
        return 0.0 if upper == math.inf else min(0.0, upper - 0.5 * FULL_CIRCLE)
    return 0.5 * (lower + upper) if upper < math.inf else max(0.0, lower + 0.5 * FULL_CIRCLE)


def is_same(joints, a, b, reach):
    """Return whether two rows of coordinates are the same solution."""
    for j in range(len(joints)):
        if joints["leader"][j] == j:
            at = joints["coordinate"][j]
            difference, unit = abs(a[at] - b[at]), reach
            if joints["kind"][j] == HINGE:
                if not joints["followed"][j]:
                    difference = min(difference, abs(FULL_CIRCLE - difference))
                unit = 1.0
            if difference > DUPLICATE * unit:
                return False
    return True


closed_form_kernel = Kernel(solve_closed_form, label="all_solutions")
settle_kernel = Kernel(settle_candidates, label="all_solutions, polishing")
