"""Questions for paper: a module per topic, in it a function per question that draws numbers and computes the key.

    labkit exam --topics 01-05 --minutes 60 --versions 3 --out exam

A question takes a random generator and returns a `Paper`: what was drawn, the text, the key (of the kit's own
functions), and wrong values with the mistake that each one tells. `draw.py` chooses questions and draws versions,
`page.py` writes them.
"""
