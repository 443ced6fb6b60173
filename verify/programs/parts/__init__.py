"""Functions that several programs share."""
