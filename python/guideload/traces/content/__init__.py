"""What a table holds: which column is meant, its time stamps, its counters, its samples in SI units."""
