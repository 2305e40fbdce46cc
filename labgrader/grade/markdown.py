"""A stranger's Markdown, made harmless: formgrader and nbgrader's feedback turn it into a page of the instructor's.

They let raw HTML through, and MathJax on the page turns `\\href` into a link that may run a script. So tags, links,
pictures and the commands of TeX that reach beyond a formula are taken apart, so that they read as what was typed; and
so are entities, since a browser would make characters of them after all that. Emphasis, lists, tables, code and
formulas stay.

What makes the page's parsers slow, whose time grows with the square of some lengths, is cut: the end of a text that is
longer than `LONGEST`, and all but the first of many spaces, or of other signs of one kind, in a row.
"""

import re

# Commands that make links, load extensions, define others or touch the page.
REACHING = (
    "href|url|require|def|gdef|edef|xdef|let|newcommand|renewcommand|providecommand|newenvironment|renewenvironment|"
    "DeclareMathOperator|DeclarePairedDelimiter\\w*|Newextarrow|class|cssId|style|data|unicode|mmlToken|includegraphics|"
    "toggle|endtoggle|mathtip|texttip|tooltip|html\\w*|bbox|input|csname|catcode|eval|special"
)


LONGEST = 20_000  # characters: ten pages
LONGEST_RUN = 200  # of one sign that is no letter; the rule of a wide table is shorter


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
        text = f"{text[:LONGEST]}\n\n(Cut here: {len(text):,} characters, of which {LONGEST:,} are shown.)"
    text = re.sub(r"&(?=#|[A-Za-z][A-Za-z0-9]*;)", "&amp;", text)
    text = re.sub(r"<(?=[A-Za-z/!?])", "< ", text)  # no tag begins with a space
    text = re.sub(r"!(?=\s*\[)", "! ", text)
    text = re.sub(r"\](?=[(\[:])", "] ", text)
    text = re.sub(r"(?i)\b(javascript|vbscript|data|file)(?=\s*:)|(https?|ftp)(?=://)", r"\g<0> ", text)
    return re.sub(rf"\\(?=(?:{REACHING})(?![A-Za-z]))", r"\\ ", text)
