"""Grading: a student's answers run in a sandbox that holds nothing worth stealing, and are judged outside it.

collect           whose a file is in the zip of a learning platform
exchange          what `nbgrader collect` takes from a hub's exchange
reading           a released lab and the submissions of it, read as data of strangers
sandbox           what a worker sees and may use: bubblewrap, `seccomp`, limits, a fresh process (`labgrader.worker`)
bwrap             which bubblewrap there is, and why it does not work where it does not
grade             one submission: every question, whatever happens in the others
copied_code       which answers hold the kit's own code
shapes            what is left of a program without names, layout and order
attempts          what a program tries that no answer needs
read_programs     both of strangers' programs, in a process with limits
alike             answers that are alike beyond what their task forces, of this class and of an earlier one
alike_page        those side by side, for the instructor
batch             a folder of submissions: what changed is graded
outputs           grades.csv, results.json, and `feedback`, a page per student
markdown          a stranger's Markdown, made harmless
diagnose_outputs  what to say about a wrong answer by its outputs, in a process with limits
changes           what an instructor changed after the release: changes.json
settings          course.toml, which is read, and written by `forget` alone
deadlines         who is late, and what it costs
roster            names and emails
gradebook         nbgrader's database and the copies that formgrader shows
students          those who were renamed, and those who are gone
forget            what is kept out of git, and a student who is to be in no file any more
totals            what students have in the end, and the end of their pages
policy            weights, what is dropped, free late days, and points for everybody
course_page       all labs together, for the instructor and for platforms
texts             answers in words on one page per question
texts_server      that page in a browser of this machine
second_look       one answer with all its cases and replies, by the key on a student's page
platforms         tables and zips that Moodle and Canvas take back
gradescope        an autograder for Gradescope, and what runs in its container
nbgrader_plugins  why nbgrader's own Autograde does nothing, and what its feedback leaves out
"""
