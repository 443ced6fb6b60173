"""The front door: the public names of the reference; `python -m plumbob` is the command line."""

from importlib.metadata import version

from reference import *
from reference import __all__ as _names
from reference import formats, mass_spring
from reference import jacobians as differential

__version__ = version("plumbob")
__all__ = ["__version__", "differential", "formats", "mass_spring"]
__all__ += _names
