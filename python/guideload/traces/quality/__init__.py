"""Checks of the samples, and repair of damage: clocks, gaps, held values, jumps."""
