"""What others published about solvers, and what is known of how they measured it.

Facts only, each with its source. "Secondary" says that we have read them in a secondary source.
"""

from typing import NamedTuple


class PublishedRate(NamedTuple):
    """A success rate [%] of TRAC-IK's README, with the mean time of all solves [ms]."""

    robot: str
    solver: str
    percent: float
    milliseconds: float
    source: str


_TAG_6, _TAG_0 = "TRAC-IK README, v1.4.6", "TRAC-IK README, v1.1.0"
# 10,000 reachable random joint configurations, 1e-5 in each component, at most 5 ms, every solve
# from the middle of the limits. The README of v1.4.6 no longer lists the UR5.
TRAC_IK = (
    PublishedRate("panda", "KDL", 61.77, 2.14, _TAG_6),
    PublishedRate("panda", "KDL with restarts", 92.67, 0.85, _TAG_6),
    PublishedRate("panda", "TRAC-IK", 99.70, 0.38, _TAG_6),
    PublishedRate("ur5", "KDL", 35.89, 3.29, _TAG_0),
    PublishedRate("ur5", "KDL with restarts", 88.71, 0.77, _TAG_0),
    PublishedRate("ur5", "TRAC-IK", 99.62, 0.40, _TAG_0),
    PublishedRate("iiwa14", "KDL", 37.64, 3.38, _TAG_6),
    PublishedRate("iiwa14", "KDL with restarts", 93.70, 0.77, _TAG_6),
    PublishedRate("iiwa14", "TRAC-IK", 99.84, 0.31, _TAG_6),
    PublishedRate("pr2", "KDL", 83.18, 1.37, _TAG_6),
    PublishedRate("pr2", "KDL with restarts", 86.87, 1.28, _TAG_6),
    PublishedRate("pr2", "TRAC-IK", 99.95, 0.38, _TAG_6),
)
TRAC_IK_TOLERANCE = 1e-5


# Haviland and Corke, "Manipulator differential kinematics" (2022), part I, table 1, by the notebook
# that goes with it: UR5, 10,000 random poses, one search of at most 500 iterations from a random
# start, half the squared error within 1e-6, limits not looked at. Infeasible [%]; another version
# of the notebook, 139d76e, has 11.02, 11.0, 9.61 and 5.35.
TOOLBOX_SOURCE = "notebook 4 of github.com/jhavl/dkt at 1155dcb, by Robotics Toolbox >= 1.0.2"


class PublishedSearch(NamedTuple):
    """A search of the toolbox's, the settings of our adapter that stand for it, and the rate."""

    title: str
    settings: dict[str, str | float]
    infeasible: float


TOOLBOX = (
    PublishedSearch("NR", {"method": "NR"}, 11.0),
    PublishedSearch("GN", {"method": "GN"}, 10.58),
    PublishedSearch("LM chan 0.1", {"method": "LM", "damping": "chan", "factor": 0.1}, 9.62),
    PublishedSearch(
        "LM wampler 1e-6", {"method": "LM", "damping": "wampler", "factor": 1e-6}, 5.34
    ),
)
TOOLBOX_ITERATIONS = 500
# Half the squared error, as the toolbox has it, at which a target counts as reached.
TOOLBOX_HALF_SQUARE = 1e-6

# Aristidou and Lasenby 2011, table 1: mean iterations over 20 runs, 10 joints, MATLAB, without
# limits: reachable, unreachable. Secondary; chain, target and tolerance are not stated there.
FABRIK_SOURCE = "Aristidou and Lasenby 2011, table 1"
FABRIK = {
    "fabrik": (15.5, 67.6),
    "ccd": (26.3, 390.0),
    "jacobian_transpose": (1311.0, 6549.0),
    "damped_least_squares": (999.0, None),
    "levenberg_marquardt": (None, None),
}
# Our guess at the set-up: nine links of 0.1 m from straight, 20 directions, the target at 0.6 m, or
# out of reach at 1.2 m, to 1e-6 m.
FABRIK_LINKS, FABRIK_LENGTH = 9, 0.1
FABRIK_DISTANCES = {"reachable": 0.6, "unreachable": 1.2}
FABRIK_TOLERANCE = 1e-6
# The most iterations for a target, here; ours come to 240.
FABRIK_ITERATIONS = 1000
FABRIK_RUNS = 20


class PublishedFrame(NamedTuple):
    """A time for one frame of a cloth [s], and what is said to have been done in it."""

    seconds: float
    done: str
    settings: dict[str, float]


# Liu, Bargteil, O'Brien, Kavan 2013: a cloth of 6,561 vertices. Secondary: abstract and captions;
# springs, stiffness, step and machine of theirs are not known to us. Ours has 81 x 81 particles and
# steps of 1/30 s.
LIU_2013 = {
    "local_global": PublishedFrame(0.050, "10 iterations", {"iterations": 10}),
    "newton": PublishedFrame(13.0, "Newton", {"tolerance": 1e-6}),
}
LIU_2013_SIZE, LIU_2013_STIFFNESS, LIU_2013_FRAME = 81, 1e3, 1 / 30
