"""The poses and cloths that the report draws, and motions that its page plays."""

# What a record is about.
ARM, CLOTH = "arm", "cloth"
ARM_MOTION, CLOTH_MOTION = "motion of the arm", "motion of the cloth"
