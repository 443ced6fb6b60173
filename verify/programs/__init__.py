"""Right programs of all tasks, as somebody would write them from a paper.

A fault or a changed line makes a wrong program of them. `../programs.toml` lists them.
"""
