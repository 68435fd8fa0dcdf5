"""Which numbers a machine really has: stiffness, damping and mass from measured data, with their uncertainty."""
