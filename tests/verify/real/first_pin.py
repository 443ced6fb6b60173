"""A net of nodes that know their neighbours; the test `if pin` overlooks the pin of index 0."""

import numpy as np


class Node:
    def __init__(self, mass, position, velocity):
        self.mass, self.x, self.v = mass, position, velocity
        self.neighbours, self.locked = [], False

    def acceleration(self, gravity):
        total = self.mass * gravity
        for other, rest, stiffness, damping in self.neighbours:
            line = self.x - other.x
            length = np.sqrt(line @ line)
            direction = line / length
            stretch, speed = length - rest, (self.v - other.v) @ direction
            total = total - (stiffness * stretch + damping * speed) * direction
        return total / self.mass


def mass_spring_step(
    masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity, positions, velocities, h
):
    nodes = [Node(*values) for values in zip(masses, positions, velocities, strict=True)]
    for (i, j), *values in zip(springs, rest_lengths, stiffnesses, dampings, strict=True):
        nodes[i].neighbours.append((nodes[j], *values))
        nodes[j].neighbours.append((nodes[i], *values))
    for pin in pinned:
        if pin:
            nodes[pin].locked = True
    accelerations = [node.acceleration(gravity) for node in nodes]
    for node, a in zip(nodes, accelerations, strict=True):
        if not node.locked:
            node.v = node.v + h * a
            node.x = node.x + h * node.v
    return {"positions": [n.x for n in nodes], "velocities": [n.v for n in nodes]}


PLUMBOB = {"step": {"method": "symplectic"}}
