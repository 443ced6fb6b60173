"""Rankings of solvers, made once from the records, for every sentence, table, map and chart."""
