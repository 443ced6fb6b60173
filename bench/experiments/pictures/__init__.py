"""The poses and cloths that the report draws."""
