"""What the first call of each public function costs: compiled then, or read from disk."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="first_call",
    chapter="speed",
    about="the first call of each public function, with nothing compiled yet",
)
