"""The cells of a table by the headings of its columns."""


def rows(table):
    """Each row as a dictionary from headings to cells."""
    headings = [column.heading for column in table.columns]
    return [dict(zip(headings, row, strict=True)) for row in table.rows]


def column(table, heading):
    return [row[heading] for row in rows(table)]


def by_solver(table, heading):
    return {row["solver"]: row[heading] for row in rows(table)}
