"""Tables of traces as they are written: file formats, dialects of text tables, headers with units."""
