"""Position-based steps in the forms of games and papers, all right; FORM says which.

`verlet`: Verlet with fifteen sweeps of constraints. `pbd`: two sweeps of rigid constraints. `soft`:
one sweep that corrects by a fixed share. `xpbd`: compliances, a sweep a substep. MISTAKE names what
a wrong program does instead.
"""

import os

import numpy as np

FORM, MISTAKE = os.environ.get("FORM", "pbd"), os.environ.get("MISTAKE", "")
SWEEPS = {"verlet": 15, "pbd": 2, "soft": 1, "xpbd": 1}[FORM.split()[0]]
SHARE = 0.3 if FORM.startswith("soft") else 1.0
SUBSTEPS = 8 if "substeps" in FORM else 1
SLOWED = 0.99 if "slowed" in FORM else 1.0
STEP = {"method": "position_based"}
if "slowed" in FORM:
    STEP |= {"damper": "global_factor", "damping_factor": 0.99}
if "substeps" in FORM:
    STEP |= {"substeps": 8}
PLUMBOB = {} if "undeclared" in FORM else {"step": STEP}


class Point:
    def __init__(self, x, v, mass, is_pin):
        self.x, self.v, self.w = x.copy(), v.copy(), 0.0 if is_pin else 1.0 / mass
        self.home, self.is_pin = x.copy(), is_pin
        if "overwritten" in FORM:
            self.w = 1.0 / mass
        if MISTAKE == "pins":
            self.w, self.home = (0.2 if is_pin else 1.0) / mass, None


def project(a, b, rest, k, h):
    """Move two points along the line between them until it has its length."""
    d = b.x - a.x
    length = np.sqrt(d @ d)
    total = a.w + b.w
    if length == 0.0 or total == 0.0:
        return
    compliance = 1.0 / (k * h * h) if FORM.startswith("xpbd") and k > 0.0 else 0.0
    if FORM.startswith("xpbd") and k == 0.0:
        return
    if MISTAKE == "h":
        compliance *= h
    push = SHARE * (length - rest) / (total + compliance)
    push = -push if MISTAKE == "sign" else 2.0 * push if MISTAKE == "twice" else push
    a.x += a.w * push * d / length
    b.x -= (a.w if MISTAKE == "mass" else b.w) * push * d / length


def mass_spring_step(
    masses, springs, rest_lengths, stiffnesses, pinned, gravity, positions, velocities, h
):
    pins = set(pinned.tolist())
    rows = zip(positions, velocities, masses, strict=True)
    points = [Point(*row, i in pins) for i, row in enumerate(rows)]
    dt = h / SUBSTEPS
    for _ in range(SUBSTEPS):
        for p in points:
            p.old = p.x.copy()
            if not p.is_pin:
                p.v = p.v * SLOWED + dt * gravity * (1.1 if MISTAKE == "gravity" else 1.0)
                p.x = p.x + dt * p.v
        for _ in range(SWEEPS):
            order = range(len(springs))
            for s in reversed(order) if "reversed" in FORM else order:
                i, j = springs[s]
                if MISTAKE == "index":
                    j = (i + 1) % len(points)
                if i != j:
                    project(points[i], points[j], rest_lengths[s], stiffnesses[s], dt)
            for p in points:
                if p.is_pin and p.home is not None:
                    p.x = p.home.copy()
        for p in points:
            p.v = (p.x - p.old) / (h if MISTAKE == "dt" else dt)
            if MISTAKE == "velocity":
                p.v = p.v * 0.5
    return {"positions": [p.x for p in points], "velocities": [p.v for p in points]}
