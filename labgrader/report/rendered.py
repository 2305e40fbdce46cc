"""Markdown as a person reads it on the page of answers in words: formatted, with pictures, and nothing that acts.

Raw HTML is text here, a link is its words and its address, and a picture is one that came in the notebook. Formulas
stay as they are between dollars, for MathJax on the page.
"""

from collections.abc import Collection
from html import escape

from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath


class Renderer(IPythonRenderer):
    """Writes HTML without addresses; pictures: the names that there are below `place`."""

    def __init__(self, pictures: Collection[str], place: str):
        super().__init__(escape=True, exclude_anchor_links=True)
        self.pictures, self.place = pictures, place

    def link(self, text: str, url: str, title: str | None = None) -> str:
        """A link as text."""
        return f"{text} ({escape(url)})"

    def image(self, text: str, url: str, title: str | None = None) -> str:
        """A picture of the notebook's, else what stands for it."""
        name, words = url.removeprefix("attachment:"), escape(text)
        if name not in self.pictures:
            return f"({words or 'a picture'}: not in the notebook)"
        return f'<img src="{escape(self.place)}/{escape(name)}" alt="{words}" loading="lazy">'

    def block_code(self, code: str, info: str | None = None) -> str:
        """Code without colours, which need a library's styles."""
        return f"<pre><code>{escape(code)}</code></pre>\n"

    def heading(self, text: str, level: int, **attributes: object) -> str:
        """A heading that is none of the page's own."""
        return f"<p><strong>{text}</strong></p>\n"


def rendered(text: str, pictures: Collection[str] = (), place: str = "") -> str:
    """The HTML of a text in Markdown.

    >>> rendered("**a** <b>, [x](http://y.z), $a_1$ and ![a plot](http://y.z/p.png)").strip()
    '<p><strong>a</strong> &lt;b&gt;, x (http://y.z), $a_1$ and (a plot: not in the notebook)</p>'
    """
    return str(MarkdownWithMath(renderer=Renderer(pictures, place))(text))
