"""How good, how fast: problems, records, tables, figures, the report and the command line."""
