"""Symbolic analysis: the order P and the supernodes of P A P' = L L', from the pattern of A."""

import numpy as np

from .dissection import nested_dissection
from .elimination_tree import column_counts, elimination_tree, postorder
from .supernodes import amalgamate, fundamental, gather, structure


def analyse(graph, order):
    """Return the order of elimination, its inverse, the supernodes and their family.

    `order` lists all vertices of the graph; it is overwritten.
    """
    nested_dissection(graph, order)
    parents = elimination_tree(graph, order, inverse(order))
    relabelling = postorder(parents)
    order, parents = composed(order, relabelling), relabelled(parents, relabelling)
    counts = column_counts(graph, order, inverse(order), parents)
    member = fundamental(parents, counts)
    relabelling, columns = gather(member, amalgamate(member, parents, counts))
    order, parents = composed(order, relabelling), relabelled(parents, relabelling)
    counts, place = composed(counts, relabelling), inverse(order)
    blocks, family = structure(graph, order, place, columns, parents, counts)
    return order, place, blocks, family


def inverse(order):
    """Return where each vertex comes in an order."""
    place = np.empty(len(order), np.int32)
    for i in range(len(order)):
        place[order[i]] = i
    return place


def composed(values, relabelling):
    """Return the values in another order."""
    result = np.empty(len(values), np.int32)
    for i in range(len(values)):
        result[i] = values[relabelling[i]]
    return result


def relabelled(parents, relabelling):
    """Return the parents after their nodes are put into another order, each before its parent."""
    place, result = inverse(relabelling), np.empty(len(parents), np.int32)
    for i in range(len(parents)):
        parent = parents[relabelling[i]]
        result[i] = place[parent] if parent >= 0 else -1
    return result
