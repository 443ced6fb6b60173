"""Explain answers by a right program with a changed line."""
