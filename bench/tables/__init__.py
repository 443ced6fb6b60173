"""Tables as values: columns and layout, and the formats in which they are written."""
