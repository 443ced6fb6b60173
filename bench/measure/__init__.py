"""How the bench runs: records, runs, worker processes, timing, the machine."""
