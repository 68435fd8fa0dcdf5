"""Reports as text, a file per kind."""
