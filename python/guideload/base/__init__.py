"""What all other packages share: errors, units, TOML files, checked models, atomic writes, number formats."""
