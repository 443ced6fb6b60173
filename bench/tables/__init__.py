"""Tables as values: their columns and layout, and the forms they are written in."""
