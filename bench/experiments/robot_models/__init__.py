"""Robots and characters from files of others, read by engines and by us."""

# What records of this suite about the bench's own robots in engines of peers are about.
PEERS = "peers"
