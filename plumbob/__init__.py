"""The front door: the public names of the reference; `python -m plumbob` is the command line.

On a terminal a line on stderr says what is compiled, once it takes more than a second.
"""

import sys
from importlib.metadata import version

from . import entry_point

# `python -m plumbob` comes through here before it reaches the command line.
if sys.argv[:1] == ["-m"] and sys.orig_argv[-len(sys.argv)] == "plumbob":
    entry_point.leave_at_interrupt()

from plumbob.reference import *
from plumbob.reference import __all__ as _names
from plumbob.reference import formats, jacobians, mass_spring

from . import compile_notice

compile_notice.install()

__version__ = version("plumbob")
__all__ = ["__version__", "formats", "jacobians", "mass_spring"]
__all__ += _names
