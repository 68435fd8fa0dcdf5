"""The load monitor on a PC: from lines of samples to loads in the terminal, on a page and in Parquet files."""
