"""Read a page in HTML: its tags, ids, links, texts and the cells of its tables."""

import html.parser

VOID = {"meta", "link", "br", "img", "input", "hr"}
CELLS = ("td", "th")


class Page(html.parser.HTMLParser):
    """What the tests ask of a page.

    Attributes:
        tags: every tag, in order; `open` those left open and `wrong` ends of others.
        ids, links: the values of `id`, and of `href` and `src`.
        texts: the texts but of styles; `bold` those of cells in bold.
        rows: the cells of each row of its tables.
    """

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.wrong = [], [], []
        self.ids, self.links, self.texts, self.bold, self.rows = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        assert not any(name.startswith("on") for name, _ in attributes)
        self.tags.append(tag)
        self.ids += [value for name, value in attributes if name == "id"]
        self.links += [value for name, value in attributes if name in ("href", "src")]
        if tag in CELLS or tag == "tr":
            self._end_cells(row=tag == "tr")
        if tag == "tr":
            self.rows.append([])
        if tag in CELLS:
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def _end_cells(self, row):
        """End a cell, and its row, which need no tags that say so."""
        for tags in (CELLS, ("tr",) if row else ()):
            if self.open and self.open[-1] in tags:
                self.open.pop()

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in CELLS:
            self._end_cells(row=tag != "tr")
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if "style" not in self.open:
            self.texts.append(data)
        if {*CELLS} & {*self.open}:
            self.rows[-1][-1] += data
            self.bold += [data] if "b" in self.open else []
