"""Probabilities of rare exceedances, by subset simulation."""
