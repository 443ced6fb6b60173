"""The greeting of a solver: its tasks, its precision, and its declared model.

A solver is judged first by its declarations. Fields left out (None) are inferred from its answers.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

PROTOCOL = 1

# The limits of a greeting, each with its reason, also in the JSON Schema.
Name = Annotated[str, Meta(max_length=100, description="the verdict shows it in one line")]
MethodName = Annotated[str, Meta(max_length=40, description="it heads rows of tables")]
Methods = Annotated[
    tuple[MethodName, ...], Meta(max_length=20, description="each is asked all cases of two tasks")
]
Joints = Annotated[int, Meta(ge=1, description="no skeleton has fewer")]
Iterations = Annotated[
    int, Meta(ge=1, le=1000, description="the judge computes as many for each case")
]
Substeps = Annotated[
    int, Meta(ge=1, le=1000, description="the judge computes as many for each case")
]
Distance = Annotated[
    float, Meta(ge=0, le=0.1, description="a solve that ends farther away misses its target")
]
Acceleration = Annotated[
    float, Meta(ge=-1000, le=1000, description="more takes particles out of their scenes")
]
Seconds = Annotated[float, Meta(gt=0, le=1, description="scenes are judged after one step")]
# The most iterations of all substeps of a step, for the same reason.
MOST_ITERATIONS = 1000

Precision = Literal["single", "double"]
Method = Literal[
    "explicit", "symplectic", "linearised", "local_global", "newton", "converged",
    "position_based",
]  # fmt: skip


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The declared time step of a solver.

    Attributes:
        method: explicit or symplectic Euler, one linearised implicit step, local/global or Newton
            iterations, implicit Euler converged, or position_based: free flight, then projections
            of springs (Verlet with constraints, PBD, XPBD), which laws alone judge.
        start: where iterations begin: x_n, y = x_n + h v_n, or s_n = y + h² M⁻¹ f_ext.
        iterations: how many of them a step has.
        substeps: how many equal steps make up h.
        damper: none; explicit; length_rate: (c/h) (l - l_n) along the spring; end_velocity:
            the force of the velocities at the end; global_factor: every velocity is scaled.
        damping_factor: the factor of global_factor for velocities in each substep; it may act
            before the forces, between forces and positions, or after both.
        pins: eliminated from the unknowns, overwritten after the solve, held by a penalty, or
            heavy.
        velocity: displacement: (x' - x_n) / h; separate: integrated beside the positions.
        order: of symplectic Euler's updates: velocities_first: v' = v + h f(x) / m, then
            x' = x + h v'; positions_first: x' = x + h v, then v' = v + h f(x') / m.
    """

    method: Method | None = None
    start: Literal["x_n", "y", "s_n"] | None = None
    iterations: Iterations | None = None
    substeps: Substeps | None = None
    damper: Literal["none", "explicit", "length_rate", "end_velocity", "global_factor"] | None = (
        None
    )
    damping_factor: float | None = None
    pins: Literal["eliminated", "overwritten", "penalty", "heavy"] | None = None
    velocity: Literal["displacement", "separate"] | None = None
    order: Literal["velocities_first", "positions_first"] | None = None


class System(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which mass-spring systems and states a solver takes.

    Attributes:
        masses, stiffnesses, dampings: a number for all, or a number each.
        rest_lengths: given, a number for all, or measured by the solver in `rest_positions`.
        gravity: any vector, or a single number g, downwards along y.
        external_forces: whether it takes them.
        tension_only: whether it knows springs that resist no compression.
        pinned: whether it can pin particles.
        state: by velocities, or by the positions a step before.
        continues: whether it goes on from its own last answer, whatever a request says; the first
            request of a case is then the only one with a state of ours.
    """

    masses: Literal["one", "each"] = "each"
    stiffnesses: Literal["one", "each"] = "each"
    dampings: Literal["one", "each"] = "each"
    rest_lengths: Literal["given", "one", "measured"] = "given"
    gravity: Literal["vector", "number"] = "vector"
    external_forces: bool = False
    tension_only: bool = False
    pinned: bool = True
    state: Literal["velocities", "previous_positions"] = "velocities"
    continues: bool = False


class Fixed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Constants of a solver in place of inputs; requests hold the same numbers.

    Attributes:
        max_iterations: the iterations of a solve that does not end earlier.
        tolerance: distance that counts as reached [m]; 0 if no distance ends a solve.
        gravity: acceleration [m/s²]; zeros without gravity.
        h: length of a step [s].
    """

    max_iterations: Iterations | None = None
    tolerance: Distance | None = None
    gravity: tuple[Acceleration, Acceleration, Acceleration] | None = None
    h: Seconds | None = None


class Greeting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The first message of a solver, before any request.

    Attributes:
        protocol: the version that it speaks.
        tasks: the offered tasks.
        name, version, language: as they are to be shown.
        precision: of its numbers.
        chains_only: whether it takes no skeletons with branches.
        max_joints: the most joints that it takes.
        effector: whether any joint may be the effector, or only the last joint.
        rotations: whether poses have rotations; else all are the identity, as for a solver that
            moves points.
        planar: whether everything lies in the plane z = 0.
        resample_by: whether it resamples curves by count, by spacing or by any of the two.
        methods: of inverse kinematics, in its own words; "ccd" and "fabrik" are understood. Each
            is asked for by the request's `method`.
        system: which mass-spring systems it takes.
        step: the time step that it declares.
        fixed: inputs that it does not read, with the constants that it has instead.
        velocity_limits: whether its robots keep the greatest speeds of a request.
        limits: whether its inverse kinematics keeps the limits of a request's joints.
    """

    protocol: int
    tasks: tuple[str, ...]
    name: Name = "solver"
    version: Name = ""
    language: Name = ""
    precision: Precision = "double"
    chains_only: bool = False
    max_joints: Joints | None = None
    effector: Literal["any", "last"] = "any"
    rotations: bool = True
    planar: bool = False
    resample_by: Literal["any", "count", "spacing"] = "any"
    methods: Methods = ("",)
    system: System = System()
    step: Step = Step()
    fixed: Fixed = Fixed()
    velocity_limits: bool = False
    limits: bool = False

    @property
    def epsilon(self) -> float:
        """The distance from 1 to the next number in the solver's precision."""
        return 2.0**-23 if self.precision == "single" else 2.0**-52
