"""The reference against both engines: verdicts, and any files of the user's."""
