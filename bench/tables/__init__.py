"""Tables as values: columns and layout, and the formats of written tables."""
