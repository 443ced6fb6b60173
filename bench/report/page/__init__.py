"""The page of the report: one HTML file from a template that escapes its texts."""
