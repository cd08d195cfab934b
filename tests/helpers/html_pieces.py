"""Pieces of HTML as tests look at them: balanced elements, attributes, rows of tables."""

from html.parser import HTMLParser

VOID = {"img", "br", "hr", "meta", "input"}


class Piece(HTMLParser):
    """elements: (tag, attributes) in order. rows: texts of the cells of each line of each table. open: elements not closed."""

    def __init__(self, html: str):
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.rows: list[list[str]] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data
        if "style" not in self.open:
            self.text += data

    def value(self, first: str) -> str:
        """Second cell of the row that begins with this text."""
        (found,) = (row[1] for row in self.rows if row[:1] == [first])
        return found


def check_piece(html: str) -> Piece:
    """Check that a piece is balanced, holds all that it shows, runs nothing, and that each picture says what it is."""
    piece = Piece(html)
    for tag, attributes in piece.elements:
        assert tag not in ("script", "iframe", "object", "link", "form"), tag
        assert not any(name.startswith("on") for name in attributes), attributes
        assert (attributes.get("src") or "data:").startswith("data:") and "href" not in attributes
        assert tag != "img" or attributes["alt"]
    assert "url(" not in html and "@import" not in html
    return piece
