"""Figures: charts as data, sketches, and their drawing."""
