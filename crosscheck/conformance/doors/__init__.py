"""The doors that a solver comes through: Python, any program, a folder of answers."""
