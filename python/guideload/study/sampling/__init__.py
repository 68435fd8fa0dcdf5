"""Sampling: distributions, sequences of uniform numbers, designs."""
