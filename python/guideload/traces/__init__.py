"""Measured traces: `format` reads tables, `content` finds columns and samples, `quality` checks and repairs them."""
