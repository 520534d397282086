"""What a page of results points to: every link and every name of a section must lead somewhere in the same page."""

import html
import re

NAMED = re.compile(r"\b(?:under|[Ss]ee (?:the )?section) ([A-Z][a-z]+(?: [a-z]+)*)|\bsection (\d+(?:\.\d+)*+)(?! of )")
"""A section that is named in words: by its entry in the contents, or by a number, which belongs to another text."""


def dead_references(page: str) -> list[str]:
    """Links to anchors that are not there, sections that the contents do not have, and numbers of sections."""
    shown = re.sub(r"<(script|style|svg)\b.*?</\1>", "", page, flags=re.S)
    anchors = set(re.findall(r'\bid="([^"]+)"', shown))
    dead = [f"#{name}" for name in re.findall(r'href="#([^"]*)"', shown) if name not in anchors]
    contents = re.search(r"<nav\b.*?</nav>", shown, re.S)
    entries = re.findall(r">([^<>]+)</a>", contents[0]) if contents else []
    for found in NAMED.finditer(html.unescape(re.sub(r"<[^>]+>", " ", shown))):
        if not (found[1] and any(found[1].startswith(entry) for entry in entries)):
            dead.append(found[0])
    return dead
