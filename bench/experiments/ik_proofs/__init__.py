"""Proofs for the poses of robots: reached, an exact solution nearby, impossible, or open."""

# The targets: of the strata of the bench, which some pose reaches, and random poses.
WITHIN_REACH, ANYWHERE = "within reach", "anywhere"
# The numbers of `IKCoverage`: proofs, and why there is none.
COVERED, IMPOSSIBLE = 0, 1
CAUSES = {2: "too few joints can move", 3: "singular", 4: "no solution nearby", 5: "at a limit"}
