"""Description of a study: varied parameters, recorded quantities, limits; and its plan and metadata."""
