"""Where samples are stored: in memory, or in a folder that survives a crash."""
