"""Figures: charts as data, sketches, and how they are drawn."""
