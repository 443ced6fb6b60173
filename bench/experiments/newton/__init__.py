"""One step of a heavy cloth by every solver, and what is proven of it."""
