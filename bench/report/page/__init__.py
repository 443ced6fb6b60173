"""The page of the report: an HTML file from a template that escapes its texts."""
