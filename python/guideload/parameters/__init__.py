"""The numbers of a machine that can vary, found by paths such as `carriages.*.stiffness_y`."""
