"""The commands of the command line that have a help page."""

COMMANDS = ("", "verify", "explain", "check", "bench", "which", "report", "show", "compare",
            "records", "records list", "records merge", "records drop")  # fmt: skip
