"""Mass-spring systems in MuJoCo: with tendons, the edges of a flex or joints as springs."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray, choice
from plumbob.reference.mass_spring import MassSpring, State

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}

JOINTS = {"slide": mujoco.mjtJoint.mjJNT_SLIDE, "hinge": mujoco.mjtJoint.mjJNT_HINGE}
# Above this number of particles MuJoCo's default estimate of its memory is excessive.
LARGE_SYSTEM = 1000
# Then its memory [bytes]: a base, and four times the measured use, two bytes for each pair of up to
# 10,000 particles.
BASE_MEMORY, PAIR_MEMORY = 2**27, 8
# MuJoCo's default of 100 iterations of "discrete" does not suffice for larger systems.
ITERATIONS = 5000
# Radius of the edges of a flex [m], required although collisions are disabled.
FLEX_RADIUS = 1e-4


class MujocoMassSpring:
    """A mass-spring system as a MuJoCo model: point masses on three slides, springs as tendons.

    A free particle is a body at the world's origin with three slide joints: its qpos are its global
    position. A pinned particle is a body without joints, positioned by `update_forces`. A spring is
    a spatial tendon between the sites of two bodies. Its `springlength` is the rest length, or for
    a tension-only spring the interval from zero to the rest length. `columns` are the indices of
    each free particle's coordinates in qpos and qvel, (free, 3).

    The integrator "discrete" omits the stiffness of a tendon exactly at its rest length and then
    differs from Gauss-Newton: do not start from the rest lengths.

    "implicitfast" keeps the entries of the damping matrix in the sparsity pattern of MuJoCo's mass
    matrix. For point masses on three slides along the axes, which MuJoCo marks `body_simple`, the
    pattern is the diagonal. Otherwise the pattern would be the 3 x 3 blocks, as for "implicit".
    Both drop the coupling of different bodies.
    """

    def __init__(self, system: MassSpring, *, h: float = 1e-3, integrator: str = "Euler") -> None:
        """Build the model, with h [s], an integrator of `INTEGRATORS`, and conjugate gradients.

        Raise a ValueError if the integrator is unknown.
        """
        self.model = self._build(system)
        self.model.opt.timestep = h
        self.set_integrator(integrator)
        self.model.opt.tolerance = 1e-15
        self.model.opt.iterations = ITERATIONS
        self.data = mujoco.MjData(self.model)
        self.free = system.free
        self.bodies = np.array(
            [self.model.body(particle_name(i)).id for i in range(system.particle_count)]
        )
        first = self.model.jnt_qposadr[self.model.body_jntadr[self.bodies[self.free]]]
        self.columns = first[:, None] + np.arange(3)

    def _build(self, system: MassSpring) -> mujoco.MjModel:
        """Return the model with the springs as tendons.

        Our springs point from the second particle to the first, a tendon from the first site to the
        second: the sites are in reverse order. The order matters only for coincident ends, because
        MuJoCo, too, then sets the direction to (1, 0, 0).
        """
        spec = particles_spec(system)
        for i, j in system.springs:
            tendon = spec.add_tendon()
            tendon.wrap_site(particle_name(j))
            tendon.wrap_site(particle_name(i))
        model = spec.compile()
        model.tendon_stiffness[:] = system.stiffnesses
        model.tendon_damping[:] = system.dampings
        model.tendon_lengthspring[:, 1] = system.rest_lengths
        model.tendon_lengthspring[:, 0] = np.where(system.tension_only, 0.0, system.rest_lengths)
        return model

    def set_integrator(self, integrator: str) -> None:
        """Set the integrator of the following steps.

        Raise a ValueError if the integrator is unknown.
        """
        self.model.opt.integrator = INTEGRATORS[choice("integrator", integrator, INTEGRATORS)]

    def write(self, state: State, external_forces: ArrayLike | None = None) -> None:
        """Reset MuJoCo's data, then write a state and external forces [N], (particle, 3).

        The reset clears the solution of the last step, from which "discrete" would start.
        """
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self.bodies[~self.free]] = state.positions[~self.free]
        self.data.qpos[self.columns] = state.positions[self.free]
        self.data.qvel[self.columns] = state.velocities[self.free]
        if external_forces is not None:
            self.data.qfrc_applied[self.columns] = np.asarray(external_forces)[self.free]

    def update_forces(self, state: State) -> None:
        """Write a state and compute all forces and energies."""
        self.write(state)
        mujoco.mj_forward(self.model, self.data)

    def read(self) -> State:
        """Read the state from MuJoCo's data; a pinned particle has velocity zero."""
        positions = self.model.body_pos[self.bodies]
        velocities = np.zeros_like(positions)
        positions[self.free] = self.data.qpos[self.columns]
        velocities[self.free] = self.data.qvel[self.columns]
        return State(positions, velocities)

    def step(
        self, state: State, external_forces: ArrayLike | None = None, *, steps: int = 1
    ) -> State:
        """Return the state after some time steps, by default 1, of MuJoCo's integrator."""
        self.write(state, external_forces)
        self.advance(steps)
        return self.read()

    def advance(self, steps: int) -> None:
        """Continue by some steps from the current state."""
        mujoco.mj_step(self.model, self.data, steps)

    def spring_forces(self) -> FloatArray:
        """Read the springs' forces on the free particles [N], (free, 3), after `update_forces`."""
        return self.data.qfrc_spring[self.columns]

    def damper_forces(self) -> FloatArray:
        """Read the dampers' forces on the free particles [N], (free, 3)."""
        return self.data.qfrc_damper[self.columns]

    def gravity_forces(self) -> FloatArray:
        """Read the weights of the free particles [N], (free, 3).

        MuJoCo includes gravity, with the opposite sign, in the bias force, whose other part, the
        Coriolis forces, vanishes for point masses on slides.
        """
        return -self.data.qfrc_bias[self.columns]

    def potential_energy(self) -> float:
        """Read the energy of springs and gravity [J]."""
        return float(self.data.energy[0])

    def kinetic_energy(self) -> float:
        """Read the kinetic energy [J]."""
        return float(self.data.energy[1])

    def lengths(self) -> FloatArray:
        """Read the springs' lengths [m], shape (spring,)."""
        return np.array(self.data.ten_length)


class MujocoFlex(MujocoMassSpring):
    """A mass-spring system in MuJoCo whose springs are the edges of a flex of dimension 1.

    All edges of a flex have the same stiffness and damping, and none is tension-only. An edge
    between two pinned particles is rigid and stores no energy. The integrator "discrete" does not
    support such a flex.
    """

    def lengths(self) -> FloatArray:
        """Read the springs' lengths [m], shape (spring,)."""
        return self.data.flexedge_length[self._edges]

    def _build(self, system: MassSpring) -> mujoco.MjModel:
        """Return the model.

        MuJoCo computes the rest lengths of edges from the initial positions and does not accept
        zero. The bodies start at distinct positions, which are then reset to the origin while the
        rest lengths are overwritten. MuJoCo sorts the edges. Raise a ValueError if the springs
        differ in stiffness or in damping, or there are none.
        """
        spec = particles_spec(system)
        for particle in range(system.particle_count):
            spec.body(particle_name(particle)).pos = (particle, 0.0, 0.0)
        flex = spec.add_flex(name="springs", dim=1, radius=FLEX_RADIUS, contype=0, conaffinity=0)
        flex.edgestiffness = _common("stiffnesses", system.stiffnesses)
        flex.edgedamping = _common("dampings", system.dampings)
        flex.vertbody = [particle_name(particle) for particle in range(system.particle_count)]
        flex.vert = np.zeros(3 * system.particle_count)
        flex.elem = system.springs.ravel()
        model = spec.compile()
        model.body_pos[:] = 0.0
        edges = {frozenset(ends): edge for edge, ends in enumerate(model.flex_edge.tolist())}
        self._edges = np.array([edges[frozenset(ends)] for ends in system.springs.tolist()])
        model.flexedge_length0[self._edges] = system.rest_lengths
        return model


class MujocoJointChain:
    """A chain of particles on the x axis, each joined to its predecessor; the first is pinned.

    Each particle is a child body of the previous one, connected by a joint with a spring and a
    damper. The coordinate of the joint is the length of the spring, and the mass matrix couples all
    joints. With hinges about a common axis, masses become moments of inertia [kg m²], coordinates
    angles [rad] and forces torques in the same equations.

    The forces of springs are linear in the coordinates as long as the ends of no spring swap; then
    "discrete" equals implicit Euler.
    """

    def __init__(self, system: MassSpring, *, h: float, joint: str) -> None:
        """Build the model for the integrator "discrete", h [s] and a joint of `JOINTS`.

        Particle 0 is pinned, spring i joins particles i and i + 1, and gravity is along x.
        """
        self._weights = system.masses[1:] * system.gravity[0]
        self.model = _nested_joints(system, JOINTS[choice("joint", joint, JOINTS)])
        self.model.opt.timestep = h
        self.data = mujoco.MjData(self.model)

    def step(
        self, state: State, external_forces: ArrayLike, *, steps: int = 1
    ) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities along x after some steps, each of shape (particle,).

        Only the x components of the state are used. Gravity is applied as a force because MuJoCo's
        gravity exerts no torque on these hinges.
        """
        start = state.positions[0, 0]
        forces = np.asarray(external_forces)[1:, 0] + self._weights
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = np.diff(state.positions[:, 0])
        self.data.qvel[:] = np.diff(state.velocities[:, 0], prepend=0.0)[1:]
        self.data.qfrc_applied[:] = np.cumsum(forces[::-1])[::-1]
        mujoco.mj_step(self.model, self.data, steps)
        x, v = np.cumsum(self.data.qpos), np.cumsum(self.data.qvel)
        return np.append(start, start + x), np.append(0.0, v)


def _nested_joints(system: MassSpring, kind: mujoco.mjtJoint) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.gravity = np.zeros(3)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.tolerance = 1e-15
    spec.option.iterations = ITERATIONS
    body = spec.worldbody
    for i, mass in enumerate(system.masses[1:], 1):
        body = add_point_mass(body, f"particle{i}", np.zeros(3), mass)
        body.inertia = np.full(3, mass)
        body.add_joint(type=kind, axis=(1.0, 0.0, 0.0))
    model = spec.compile()
    model.jnt_stiffness[:] = system.stiffnesses
    model.dof_damping[:] = system.dampings
    model.qpos_spring[:] = system.rest_lengths
    return model


def particles_spec(system: MassSpring) -> mujoco.MjSpec:
    """Return the bodies of the system, each with a site; energies are computed in forward passes.

    MuJoCo's automatic reset of diverging simulations is disabled.
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = system.gravity
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if system.particle_count > LARGE_SYSTEM:
        spec.memory = BASE_MEMORY + PAIR_MEMORY * system.particle_count**2
    for particle, (mass, free) in enumerate(zip(system.masses, system.free, strict=True)):
        body = add_point_mass(spec.worldbody, particle_name(particle), np.zeros(3), mass)
        body.add_site(name=particle_name(particle))
        for axis in np.eye(3) if free else ():
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    return spec


def add_point_mass(
    parent: mujoco.MjsBody, name: str, position: FloatArray, mass: float
) -> mujoco.MjsBody:
    """Return a new body at a position in its parent's frame, with its mass at its origin."""
    body = parent.add_body(name=name, pos=position)
    body.mass, body.ipos, body.inertia = mass, np.zeros(3), np.ones(3)
    body.explicitinertial = True
    return body


def particle_name(i: int) -> str:
    """Return the name of a particle's body and site."""
    return f"particle{i}"


def _common(name: str, per_spring: FloatArray) -> float:
    """Return the common number of all springs; a ValueError if springs differ."""
    if len(np.unique(per_spring)) != 1:
        distinct = np.unique(per_spring)
        raise ValueError(f"{name}: expected the same for all springs, got {distinct}")
    return float(per_spring[0])
