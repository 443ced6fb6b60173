"""Mass-spring systems in MuJoCo: point masses on slides, joined by tendons."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from reference.arguments import FloatArray, choice
from reference.mass_spring import MassSpring, State

from .mujoco_bodies import add_point_mass

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}

# MuJoCo's own guess at the memory for so many particles is more than there is. What it comes to use
# was measured at up to 10,000: two bytes for each pair.
MANY = 1000
BASE_MEMORY, PAIR_MEMORY = 2**27, 8


class MujocoMassSpring:
    """A mass-spring system as a MuJoCo model: point masses on three slides, springs as tendons.

    A free particle is a body at the world's origin with three slide joints, so that its qpos are
    its global position; a pinned one is a body of the world, moved by `place`. A spring is a
    spatial tendon between the sites of two bodies: its `springlength` is the rest length, or for a
    tension-only spring anything from zero to it, its stiffness and damping act along it.

    A tendon exactly at its rest length has no stiffness for the integrator "discrete", which then
    takes another step than Gauss-Newton: start from a state that has moved.

    "implicitfast" keeps of the dampers' matrix what fits the pattern of MuJoCo's mass matrix. A
    body that is a point mass on three slides along the axes is `body_simple` to it: its mass
    matrix is a diagonal. Bodies with their mass off their origin or with slanting slides would
    keep the whole 3 x 3 block, as "implicit" always does. Neither keeps what couples two bodies.

    Attributes:
        model: the mujoco.MjModel.
        data: its mujoco.MjData.
        bodies: MuJoCo's index of each particle's body, found by name.
        free: which particles may move, bool, shape (particle,).
        columns: where each free particle's coordinates stand in qpos and qvel, shape (free, 3).
    """

    def __init__(
        self,
        system: MassSpring,
        *,
        h: float = 1e-3,
        integrator: str = "Euler",
        iterations: int = 5000,
    ) -> None:
        """Build the model.

        Args:
            system: the particles and springs.
            h: time step [s].
            integrator: one of `INTEGRATORS`.
            iterations: most conjugate gradient iterations of "discrete"; MuJoCo's own default of
                100 stops it short on larger systems.

        Raises:
            ValueError: if there is no such integrator.
        """
        self.model = self._build(system)
        self.model.opt.timestep = h
        self.choose(integrator)
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
        return tendon_model(system)

    def choose(self, integrator: str) -> None:
        """Step with this integrator from now on.

        Raises:
            ValueError: if there is no such integrator.
        """
        self.model.opt.integrator = INTEGRATORS[choice("integrator", integrator, INTEGRATORS)]

    def write(self, state: State, external_forces: ArrayLike | None = None) -> None:
        """Write a state and external forces [N], (particle, 3), into MuJoCo's data, reset first.

        A reset forgets the last step's solution, with which "discrete" would start.
        """
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self.bodies[~self.free]] = state.positions[~self.free]
        self.data.qpos[self.columns] = state.positions[self.free]
        self.data.qvel[self.columns] = state.velocities[self.free]
        if external_forces is not None:
            self.data.qfrc_applied[self.columns] = np.asarray(external_forces)[self.free]

    def place(self, state: State) -> None:
        """Write a state and let MuJoCo compute all forces and energies there."""
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
        """Return the state some time steps later, one if not told, by MuJoCo's integrator."""
        self.write(state, external_forces)
        self.go_on(steps)
        return self.read()

    def go_on(self, steps: int) -> None:
        """Take so many steps more from where the last one ended."""
        mujoco.mj_step(self.model, self.data, steps)

    def spring_forces(self) -> FloatArray:
        """Read the springs' forces on the free particles [N], (free, 3), after `place`."""
        return self.data.qfrc_spring[self.columns]

    def damper_forces(self) -> FloatArray:
        """Read the dampers' forces on the free particles [N], (free, 3)."""
        return self.data.qfrc_damper[self.columns]

    def gravity_forces(self) -> FloatArray:
        """Read the weights of the free particles [N], (free, 3).

        MuJoCo counts gravity into the bias on the other side of the equation of motion. Point
        masses on slides have no Coriolis forces, so gravity is all there is in it.
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


def tendon_model(system: MassSpring) -> mujoco.MjModel:
    """Return the bodies of the system, and its springs as tendons.

    Our spring's direction runs from its second particle to its first, a tendon's from its first
    site to its second: the sites are given in reverse order. It matters only where they coincide,
    and both of us then take the direction (1, 0, 0).
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


def particles_spec(system: MassSpring) -> mujoco.MjSpec:
    """Return the bodies of the system, each with a site, with energies at every forward pass.

    A motion that blows up is left to do so: MuJoCo would start it afresh.
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


def particle_name(i: int) -> str:
    """Return the name of a particle's body and site."""
    return f"particle{i}"
