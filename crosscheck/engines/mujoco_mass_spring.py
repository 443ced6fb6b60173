"""Mass-spring systems in MuJoCo, with point masses on slides and tendons as springs."""

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

# Above this number of particles MuJoCo's default estimate of its memory is excessive. The actual
# use, measured for up to 10,000 particles, is two bytes for each pair.
MANY = 1000
BASE_MEMORY, PAIR_MEMORY = 2**27, 8


class MujocoMassSpring:
    """A mass-spring system as a MuJoCo model: point masses on three slides, springs as tendons.

    A free particle is a body at the world's origin with three slide joints, so that its qpos are
    its global position; a pinned one is a body without joints, positioned by `update_forces`. A
    spring is a spatial tendon between the sites of two bodies. Its `springlength` is the rest
    length, or for a tension-only spring the interval from zero to it.

    The integrator "discrete" omits the stiffness of a tendon that is exactly at its rest length and
    then differs from Gauss-Newton: do not start from the rest lengths.

    "implicitfast" keeps the entries of the damping matrix in the sparsity pattern of MuJoCo's mass
    matrix. For point masses on three slides along the axes, which MuJoCo marks `body_simple`, that
    is its diagonal. Otherwise it would be the 3 x 3 blocks, as for "implicit". Both drop the
    coupling of different bodies.

    Attributes:
        model: the mujoco.MjModel.
        data: its mujoco.MjData.
        bodies: MuJoCo's index of each particle's body, found by name.
        free: whether each particle is free, bool, shape (particle,).
        columns: indices of each free particle's coordinates in qpos and qvel, shape (free, 3).
    """

    def __init__(
        self,
        system: MassSpring,
        *,
        h: float = 1e-3,
        integrator: str = "Euler",
        iterations: int = 5000,
    ) -> None:
        """Build the model, with h [s], an integrator of `INTEGRATORS`, and conjugate gradients.

        MuJoCo's default of 100 iterations of "discrete" does not suffice for larger systems.

        Raises:
            ValueError: if the integrator is unknown.
        """
        self.model = self._build(system)
        self.model.opt.timestep = h
        self.set_integrator(integrator)
        self.model.opt.tolerance = 1e-15
        self.model.opt.iterations = iterations
        self.data = mujoco.MjData(self.model)
        self.free = system.free
        self.bodies = np.array(
            [self.model.body(particle_name(i)).id for i in range(system.particle_count)]
        )
        first = self.model.jnt_qposadr[self.model.body_jntadr[self.bodies[self.free]]]
        self.columns = first[:, None] + np.arange(3)

    def _build(self, system: MassSpring) -> mujoco.MjModel:
        """Return the model with the springs as tendons.

        The direction of our springs is from the second particle to the first, that of a tendon from
        the first site to the second: the sites are in reverse order. This matters only where they
        coincide, because MuJoCo, too, then sets the direction to (1, 0, 0).
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

        Raises:
            ValueError: if the integrator is unknown.
        """
        self.model.opt.integrator = INTEGRATORS[choice("integrator", integrator, INTEGRATORS)]

    def write(self, state: State, external_forces: ArrayLike | None = None) -> None:
        """Reset MuJoCo's data, then write a state and external forces [N], (particle, 3), into it.

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
        """Return the state after some time steps, by default one, of MuJoCo's integrator."""
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


def particles_spec(system: MassSpring) -> mujoco.MjSpec:
    """Return the bodies of the system, each with a site; energies are computed in forward passes.

    MuJoCo's automatic reset of diverging simulations is disabled.
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = system.gravity
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if system.particle_count > MANY:
        spec.memory = BASE_MEMORY + PAIR_MEMORY * system.particle_count**2
    for i, (mass, free) in enumerate(zip(system.masses, system.free, strict=True)):
        body = add_point_mass(spec.worldbody, particle_name(i), np.zeros(3), mass)
        body.add_site(name=particle_name(i))
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
