"""How samples are drawn: distributions, sequences of uniform numbers, designs."""
