"""The laws as a test for your own pytest file: `test_my_solver = laws(my_module)`."""

from plumbob.verify.pytest_laws import laws

__all__ = ["laws"]
