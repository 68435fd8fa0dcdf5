"""Studies: what the loads of many machines are that differ as real ones do."""
