"""What every change of a right program answers to a few requests, computed once."""
