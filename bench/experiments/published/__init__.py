"""Published tables measured again in their own set-up."""

# What a record is about.
TRAC_IK, TOOLBOX, FABRIK = "TRAC-IK’s table", "the toolbox’s table", "FABRIK’s table"
