"""Published tables measured again in their own set-up."""

# The tasks of records.
TRAC_IK, TOOLBOX, FABRIK = "TRAC-IK’s table", "the toolbox’s table", "FABRIK’s table"
