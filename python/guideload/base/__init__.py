"""Shared by all other packages: errors, units, TOML files and checked models, atomic writes, number formats."""
