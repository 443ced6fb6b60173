"""A table as a fragment of HTML that needs nothing but itself: no style sheet, no script."""

from html import escape

from .table import POWER, Column, Table, best_cells, words

_CELL = "padding:0.15em 0.6em"
_LINE = "border-bottom:1px solid currentColor"


def fragment(table: Table) -> str:
    """Return a table as HTML, titled and explained, the best cells bold."""
    best = best_cells(table)
    head = "".join(_head(column) for column in table.columns)
    rows = [
        "".join(_cell(table, i, j, (i, j) in best) for j in range(len(table.columns)))
        for i in range(len(table.rows))
    ]
    about = " ".join(filter(None, (table.shows, table.measured, table.provenance)))
    lines = [
        '<figure class="plumbob" style="overflow-x:auto;margin:1em 0">',
        '<table style="border-collapse:collapse;font-variant-numeric:tabular-nums">',
        f'<caption style="text-align:left"><b>{_text(table.title)}.</b></caption>',
        f"<thead><tr>{head}</tr></thead>",
        *("<tbody>", *(f"<tr>{row}</tr>" for row in rows), "</tbody>"),
        "</table>",
        f"<figcaption>{_text(about)}</figcaption>",
        "</figure>",
    ]
    return "\n".join(lines) + "\n"


def _head(column: Column) -> str:
    style = f"text-align:{'left' if column.words else 'right'};{_CELL};{_LINE}"
    return f'<th scope="col" style="{style}">{_text(column.heading)}</th>'


def _cell(table: Table, i: int, j: int, is_best: bool) -> str:
    """Return a cell; the first of a row is its head."""
    text = _text(words(table.rows[i][j]))
    inner = f"<b>{text}</b>" if is_best else text
    style = f"text-align:{'left' if table.columns[j].words else 'right'};{_CELL}"
    if j == 0:
        return f'<th scope="row" style="{style};font-weight:normal">{inner}</th>'
    return f'<td style="{style}">{inner}</td>'


def _text(text: str) -> str:
    escaped = escape(" ".join(text.split()))
    return POWER.sub(lambda m: f"{m[1]}·10<sup>{m[2]}</sup>".replace("-", "−"), escaped)
