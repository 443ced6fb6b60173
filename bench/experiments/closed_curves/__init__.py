"""Closed curves tracked round after round: largest joint steps and drift."""
