"""From candidates to solutions: Newton's method, limits, forward kinematics, no duplicates."""

import math

import numpy as np

from ...articulation import HINGE, LIMIT_TOLERANCE
from ...backend.compiled import Kernel
from ..bounded_step import (
    FULL_CIRCLE,
    fill_errors,
    fill_jacobian,
    new_system,
    solve_system,
)
from ..linear_algebra import clear, inner
from ..mechanism import TARGET, Mechanism, errors, new_data, update_forward_kinematics
from ..restarts import copy_row
from ..solve_mechanism import normalise_target
from .closed_forms import ClosedForm, fill_candidates, new_roots
from .subproblems import CERTAIN

# A solution reaches its target within this, over the reach, and this angle [rad]. Of 2,098
# solutions for 300 poses of a UR5 the worst is off by 2.4e-14.
TOLERANCE = 1e-9
# Solutions are the same if their coordinates differ by no more, over the reach for slides. The
# nearest two of these solutions are 1.3e-3 rad apart; near a double root a rounding of 1e-14 parts
# copies by 1e-7.
DUPLICATE = 1e-6
# A candidate this near to the target or a limit may or may not be a solution: near a double root,
# rounding by e moves the root by sqrt(e).
DOUBTFUL = 1e-6
# Errors below this, over the reach, are rounding of the forward kinematics: some ten for each of
# six joints.
ROUNDING = 64 * 2.220446049250313e-16
# A candidate this far beyond its limits, over the reach or [rad], does not come back: the polish
# moves by far less. A smaller number would only save time.
BEYOND_RETURN = 0.1
# Steps of Newton's method; closed forms need none or a single step. Near a double root a step
# halves the error and quarters the residual: twelve divide the residual by 1.7e7.
NEWTON_STEPS = 12
# Columns behind the coordinates: distance [m], angle [rad], and how many candidates came there.
FIGURES = 3


def solve_closed_form(mechanism_fields, form_fields, position, rotation, rows):
    """Fill the solutions of a closed form; return their number, -1 for an invalid target.

    Also return the certainty of the number of candidates, and how many of them are in doubt. The
    fields of Mechanism and of ClosedForm come in plain tuples, as for `solve_mechanisms`. Position
    [m] and rotation are the target's; a row to fill has coordinates of the mechanism, then FIGURES.
    """
    target = np.empty(1, TARGET)
    for k in range(3):
        target["position"][0, k] = position[k]
    for k in range(4):
        target["rotation"][0, k] = rotation[k]
    target["weight"][0] = 1.0
    if not normalise_target(target):
        return -1, CERTAIN, 0
    mechanism, work = Mechanism(*mechanism_fields), new_roots()
    count, status = fill_candidates(ClosedForm(*form_fields), mechanism.reach, target, work)
    count, doubts = settle(mechanism, target, work.candidates[:count], rows)
    return count, status, doubts


def settle_candidates(mechanism_fields, candidates, targets, rows):
    """Fill the solutions among candidates; return their number and that of doubtful candidates."""
    return settle(Mechanism(*mechanism_fields), targets[0], candidates, rows)


def settle(mechanism, target, candidates, rows):
    """Fill the solutions among candidates; see `settle_candidates`."""
    data, system = new_data(mechanism), new_system(mechanism.equations, mechanism.freedoms)
    clear(system.active)
    count, doubts, reach, width = 0, 0, mechanism.reach, len(data.q)
    for i in range(len(candidates)):
        copy_row(candidates[i], data.q)
        if bring_within_limits(mechanism.joints, data.q, reach) > BEYOND_RETURN:
            continue
        polish(mechanism, target, data, system)
        gap = bring_within_limits(mechanism.joints, data.q, reach)
        if gap > 0.0:
            update_forward_kinematics(mechanism, data)
        distance, angle = errors(mechanism, target, data, 0)
        is_near = distance <= DOUBTFUL * reach and angle <= DOUBTFUL and gap <= DOUBTFUL
        if not (distance <= TOLERANCE * reach and angle <= TOLERANCE and gap <= LIMIT_TOLERANCE):
            doubts += is_near
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
    update_forward_kinematics(mechanism, data)
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
    """Bring angles within limits, as near to the middle as whole revolutions do.

    A joint with followers keeps its angle, as a revolution would not bring the followers around.

    Returns how far beyond a limit some coordinate is, lengths over the reach.
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
