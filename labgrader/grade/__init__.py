"""What is decided: points of answers, and of persons.

grade             one submission: every question, whatever happens in the others
copied_code       which answers hold the kit's own code
shapes            what is left of a program without names, layout and order
attempts          what a program tries that no answer needs
read_programs     strangers' programs as syntax trees, in a process with limits
batch             a folder of submissions: what changed is graded
markdown          a stranger's Markdown, made harmless
diagnose_outputs  what to say about a wrong answer by its outputs, in a process with limits
changes           what an instructor changed after the release: changes.json
settings          course.toml, which is read, and written by `forget` alone
deadlines         who is late, and what it costs
gradebook         nbgrader's database and the copies that formgrader shows
students          those who were renamed, and those who are gone
totals            what students have in the end, and the end of their pages
overview          the class: who tried and passed, which mistakes, comments for all of them
policy            weights, what is dropped, free late days, and points for everybody
nbgrader_plugins  why nbgrader's own Autograde does nothing, and what its feedback leaves out
"""
