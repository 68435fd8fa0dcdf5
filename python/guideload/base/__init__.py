"""What every other package stands on: errors, units, checked configuration, atomic writes, number formats."""
