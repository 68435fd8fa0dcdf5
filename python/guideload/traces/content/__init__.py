"""From a table to samples: choice of columns, time stamps, unwrapped counters, values in SI units."""
