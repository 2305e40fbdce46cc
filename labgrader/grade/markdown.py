"""A stranger's Markdown, made harmless: formgrader and nbgrader's feedback turn it into a page of the instructor's.

They let raw HTML through, and MathJax on the page turns `\\href` into a link that may run a script. So tags, links,
pictures and the commands of TeX that reach beyond a formula are taken apart, so that they read as what was typed; and
so are entities, since a browser would make characters of them after all that. Emphasis, lists, tables, code and
formulas stay.

What makes the page's parsers slow, whose time grows with the square of some lengths, is cut: the end of a text that is
longer than `LONGEST`, and all but the first of many spaces, or of other signs of one kind, in a row.
"""

import re
from urllib.parse import unquote

from labgrader.handin.pictures import Pictures

# Commands that make links, load extensions, define others or touch the page.
REACHING = (
    "href|url|require|def|gdef|edef|xdef|let|newcommand|renewcommand|providecommand|newenvironment|renewenvironment|"
    "DeclareMathOperator|DeclarePairedDelimiter\\w*|Newextarrow|class|cssId|style|data|unicode|mmlToken|includegraphics|"
    "toggle|endtoggle|mathtip|texttip|tooltip|html\\w*|bbox|input|csname|catcode|eval|special"
)


LONGEST = 20_000  # characters: ten pages
CUT = "(Cut here: {:,} characters, of which {:,} are shown.)"
PICTURE = re.compile(r"!\[([^\[\]\n]*)\]\(attachment:([^\s()<>]+)\)")
LONGEST_RUN = 200  # of one sign that is no letter; the rule of a wide table is shorter


def harmless_with_pictures(text: str, pictures: Pictures) -> tuple[str, Pictures]:
    """Take a text apart but for its pictures, which get names of this page's making; one that it does not show ends it.

    >>> harmless_with_pictures("![a](attachment:x.png) ![b](attachment:y.png)", {"x.png": {"image/png": "iVBO"}})
    ('![a](attachment:picture-1.png) ! [b] (attachment:y.png)', {'picture-1.png': {'image/png': 'iVBO'}})
    """
    names = {name: f"picture-{i}.{next(iter(pictures[name])).partition('/')[2]}" for i, name in enumerate(pictures, 1)}
    pieces, shown = PICTURE.split(text[:LONGEST]), set()
    said = ""
    for before, alt, name in zip(pieces[::3], [*pieces[1::3], ""], [*pieces[2::3], ""], strict=True):
        said += harmless_markdown(before)
        if (known := names.get(unquote(name), names.get(name))) is not None:
            said += f"![{harmless_markdown(alt)}](attachment:{known})"
            shown.add(known)
        elif name:
            said += harmless_markdown(f"![{alt}](attachment:{name})")
    said += f"\n\n{CUT.format(len(text), LONGEST)}" if len(text) > LONGEST else ""
    said += "".join(f"\n\n![{known}](attachment:{known})" for known in names.values() if known not in shown)
    return said, {names[name]: picture for name, picture in pictures.items()}


def harmless_markdown(text: str) -> str:
    """Take apart what would be more than text and formulas on a page.

    >>> harmless_markdown("**a < b**, $x^2$ <img src=x onerror=alert(1)>")
    '**a < b**, $x^2$ < img src=x onerror=alert(1)>'
    >>> harmless_markdown("[here](javascript:alert(1)) and ![](http://a.b/c.png)")
    '[here] (javascript :alert(1)) and ! [] (http ://a.b/c.png)'
    >>> harmless_markdown("&#36;&#92;href{x}{y}&#36;, R&D")
    '&amp;#36;&amp;#92;href{x}{y}&amp;#36;, R&D'
    """
    text = re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]", "", text)  # controls and directions
    text = re.sub(rf"([^\w\n])\1{{{LONGEST_RUN},}}", lambda run: run[1] * LONGEST_RUN, text)
    if len(text) > LONGEST:
        text = f"{text[:LONGEST]}\n\n{CUT.format(len(text), LONGEST)}"
    text = re.sub(r"&(?=#|[A-Za-z][A-Za-z0-9]*;)", "&amp;", text)
    text = re.sub(r"<(?=[A-Za-z/!?])", "< ", text)  # no tag begins with a space
    text = re.sub(r"!(?=\s*\[)", "! ", text)
    text = re.sub(r"\](?=[(\[:])", "] ", text)
    text = re.sub(r"(?i)\b(javascript|vbscript|data|file)(?=\s*:)|(https?|ftp)(?=://)", r"\g<0> ", text)
    return re.sub(rf"\\(?=(?:{REACHING})(?![A-Za-z]))", r"\\ ", text)
