"""Skeletons and mass-spring systems in MuJoCo."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from reference.arguments import FloatArray, choice
from reference.mass_spring import MassSpring, State
from reference.skeleton import Pose, Skeleton

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}


class MujocoSkeleton:
    """A skeleton as a MuJoCo model: a body with a ball joint for each of our joints.

    MuJoCo orders bodies depth-first, we keep the order given: joints are found by name. It
    normalises quaternions itself.

    Attributes:
        model: the mujoco.MjModel; its bodies and joints carry our names.
        data: its mujoco.MjData.
        bodies: MuJoCo's index of each of our joints' bodies.
        columns: where each joint's (w, x, y, z) stand in qpos, shape (joint, 4).
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = mujoco_skeleton(skeleton)
        self.data = mujoco.MjData(self.model)
        self.bodies = np.array([self.model.body(name).id for name in skeleton.names])
        first = np.array([self.model.joint(name).qposadr[0] for name in skeleton.names])
        self.columns = first[:, None] + np.arange(4)

    def place(self, q: FloatArray) -> None:
        """Put the skeleton where the coordinates q say."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)

    def pose(self) -> Pose:
        """Read where `place` has put every joint."""
        return Pose(self.data.xpos[self.bodies], self.data.xquat[self.bodies])

    def position(self, joint: int) -> FloatArray:
        """Read where `place` has put one joint [m], shape (3,)."""
        return np.array(self.data.xpos[self.bodies[joint]])

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Place, and return the joint's velocity [m] per velocity coordinate, (3, 3 joint).

        `mj_jacBody` reads the joints' axes that `mj_comPos` computes from the kinematics.
        """
        self.place(q)
        mujoco.mj_comPos(self.model, self.data)
        J = np.empty((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, J, None, self.bodies[joint])
        return J

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates reached from q by moving with the velocity v for 1 s."""
        moved = np.array(q)
        mujoco.mj_integratePos(self.model, moved, v, 1.0)
        return moved


def mujoco_skeleton(skeleton: Skeleton) -> mujoco.MjModel:
    """Return the tree of bodies, each at its offset in its parent's frame, with a ball joint there.

    MuJoCo asks for masses; kinematics does not read them.
    """
    spec = mujoco.MjSpec()
    bodies: list[mujoco.MjsBody] = []
    for name, parent, offset in zip(
        skeleton.names, skeleton.parents, skeleton.offsets, strict=True
    ):
        above = spec.worldbody if parent < 0 else bodies[parent]
        body = _add_point_mass(above, name, offset, 1.0)
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_BALL)
        bodies.append(body)
    return spec.compile()


class MujocoMassSpring:
    """A mass-spring system as a MuJoCo model: point masses on three slides, springs as tendons.

    A free particle is a body at the world's origin with three slide joints, so that its qpos are
    its global position; a pinned one is a body of the world, moved by `place`. A spring is a
    spatial tendon between the sites of two bodies: its `springlength` is the rest length, its
    stiffness and damping act along it.

    A tendon exactly at its rest length has no stiffness for the integrator "discrete", which then
    takes another step than Gauss-Newton: start from a state that has moved.

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
        self.model = mujoco_mass_spring(system)
        self.model.opt.timestep = h
        self.model.opt.integrator = INTEGRATORS[choice("integrator", integrator, INTEGRATORS)]
        self.model.opt.tolerance = 1e-15
        self.model.opt.iterations = iterations
        self.data = mujoco.MjData(self.model)
        self.free = system.free
        self.bodies = np.array(
            [self.model.body(_particle(i)).id for i in range(system.particle_count)]
        )
        first = self.model.jnt_qposadr[self.model.body_jntadr[self.bodies[self.free]]]
        self.columns = first[:, None] + np.arange(3)

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

    def step(self, state: State, external_forces: ArrayLike | None = None) -> State:
        """Return the state one time step later, by MuJoCo's integrator."""
        self.write(state, external_forces)
        mujoco.mj_step(self.model, self.data)
        return self.read()

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


def mujoco_mass_spring(system: MassSpring) -> mujoco.MjModel:
    """Return the bodies and tendons of the system, with energies computed at every forward pass.

    A motion that blows up is left to do so: MuJoCo would start it afresh.

    Our spring's direction runs from its second particle to its first, a tendon's from its first
    site to its second: the sites are given in reverse order. It matters only where they coincide,
    and both of us then take the direction (1, 0, 0).
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = system.gravity
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for i, (mass, free) in enumerate(zip(system.masses, system.free, strict=True)):
        body = _add_point_mass(spec.worldbody, _particle(i), np.zeros(3), mass)
        body.add_site(name=_particle(i))
        for axis in np.eye(3) if free else ():
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    for i, j in system.springs:
        tendon = spec.add_tendon()
        tendon.wrap_site(_particle(j))
        tendon.wrap_site(_particle(i))
    model = spec.compile()
    model.tendon_stiffness[:] = system.stiffnesses
    model.tendon_damping[:] = system.dampings
    model.tendon_lengthspring[:] = system.rest_lengths[:, None]
    return model


def _particle(i: int) -> str:
    return f"particle{i}"


def _add_point_mass(
    parent: mujoco.MjsBody, name: str, position: FloatArray, mass: float
) -> mujoco.MjsBody:
    body = parent.add_body(name=name, pos=position)
    body.mass, body.ipos, body.inertia = mass, np.zeros(3), np.ones(3)
    body.explicitinertial = True
    return body
