"""Results of a study: columns, statistics, probabilities, tables, files."""
