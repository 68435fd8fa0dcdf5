"""What a study gives: columns, statistics, probabilities, tables, files."""
