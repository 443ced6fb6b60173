"""The page of the report, from a template that escapes whatever is put into it."""
