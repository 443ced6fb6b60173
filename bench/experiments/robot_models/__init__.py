"""Robots and characters from files of others, read by engines and by us."""

# The task of records on the bench's own robots in engines of peers.
PEERS = "peers"
