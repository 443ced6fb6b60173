"""The poses and cloths drawn in the report, and the motions played on its page."""

# What a record is about.
ARM, CLOTH = "arm", "cloth"
ARM_MOTION, CLOTH_MOTION = "motion of the arm", "motion of the cloth"
