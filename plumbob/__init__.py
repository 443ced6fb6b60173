"""The front door: the public names of the reference; `python -m plumbob` is the command line."""

from importlib.metadata import version

from reference import *
from reference import __all__ as _names
from reference import formats, jacobians, mass_spring

__version__ = version("plumbob")
__all__ = ["__version__", "formats", "jacobians", "mass_spring"]
__all__ += _names
