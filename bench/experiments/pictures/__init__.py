"""The poses and cloths that the report draws."""

# What a record is about.
ARM, CLOTH = "arm", "cloth"
