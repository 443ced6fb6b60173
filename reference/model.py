"""The models of public functions: a Skeleton, an Articulation, or a Robot."""

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from .arguments import FloatArray
from .articulation import Articulation
from .skeleton import Skeleton

if TYPE_CHECKING:
    from .inverse_kinematics.tasks import IKTask


class Robot(NamedTuple):
    """A robot or a character read from a file."""

    # a joint for each link or body of the file, with its name and pose
    articulation: Articulation
    # index of the articulation's joint by the name of the file's joint; its coordinates in q are
    # `articulation.coordinates_of(joints[name])`
    joints: dict[str, int]
    home: FloatArray  # the coordinates of the configuration in the file, (coordinate,)
    masses: FloatArray  # of the links [kg], NaN where the file leaves them to meshes, (joint,)
    centres: FloatArray  # the links' centres of mass in the joints' frames [m], (joint, 3)
    equalities: "tuple[IKTask, ...]" = ()  # loop closures and couplings, as tasks


Model: TypeAlias = "Skeleton | Articulation | Robot"


def checked_model(model: Any, argument: str = "skeleton") -> Skeleton | Articulation:
    """Return the model, of a Robot its articulation; else raise a ValueError about the argument."""
    if isinstance(model, Skeleton) or isinstance(model, Articulation):  # noqa: SIM101, a union is slow
        return model
    if isinstance(model, Robot):
        return model.articulation
    raise ValueError(
        f"{argument}: expected a Skeleton, an Articulation or a Robot, got {type(model).__name__}"
    )


def coordinates_name(model: Skeleton | Articulation) -> str:
    """Return the name of a model's coordinates: q, or local_rotations of a Skeleton."""
    return "local_rotations" if isinstance(model, Skeleton) else "q"


def effector_of(model: Skeleton | Articulation, effector: int | str | None) -> int:
    """Return the index of the effector named; None is a Skeleton's last joint, else the only tip.

    An unknown joint, or None where there are several tips, is a ValueError.
    """
    if effector is not None:
        return model.index(effector, "effector")
    if isinstance(model, Skeleton):
        return model.joint_count - 1
    tips = model.skeleton.tips
    if len(tips) > 1:
        names = ", ".join(model.names[tip] for tip in tips)
        raise ValueError(f"effector: expected one of the tips {names}, got none")
    return tips[0]
