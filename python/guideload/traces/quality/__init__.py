"""Whether samples can be used: clocks, gaps, held values, jumps; and their repair."""
