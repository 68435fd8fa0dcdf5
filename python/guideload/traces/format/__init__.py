"""Tables of traces: file formats, dialects of text tables, headers with units."""
