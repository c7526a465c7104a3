"""A page taken apart, for the tests of all pages."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "br", "hr", "img", "link", "input"}
HOSTILE = (
    '</script><script>alert("x")</script><img src=http://evil.example/a onerror=alert(1)>&<!--'
)


class Page(HTMLParser):
    """A page taken apart: elements, text outside scripts, scripts; every element must close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.scripts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"]:
            self.scripts.append(data)
        elif self.open[-1:] != ["style"]:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join("".join(self.words).replace("\u00a0", " ").split())

    @property
    def figures(self) -> dict[str, Any]:
        """Data of every figure, by its name."""
        return dict(json.loads(self.scripts[0])["figures"])

    def column(self, figure: str, name: str) -> list[float | None]:
        """A column of a figure's data, by the name before its unit."""
        table = self.figures[figure]
        (at,) = [n for n, head in enumerate(table["head"]) if head.partition(" [")[0] == name]
        return list(table["columns"][at])

    @property
    def shown(self) -> list[str]:
        """Names of the figures that the page shows, in their order."""
        return [str(a["data-figure"]) for _, a in self.elements if "data-figure" in a]

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.elements)

    def require_whole(self) -> None:
        """One heading, captioned tables, single ids, data of every figure; nothing from outside."""
        assert self.count("h1") == 1
        assert self.count("script") == 2
        assert self.count("table") == self.count("caption")
        for tag, attributes in self.elements:
            assert tag not in {"link", "iframe", "object", "img"}
            assert not {"src", "action", "srcset"} & attributes.keys()
            assert str(attributes.get("href", "#")).startswith("#")
        ids = [a["id"] for _, a in self.elements if "id" in a]
        assert len(ids) == len(set(ids))
        assert set(self.shown) == self.figures.keys()
