"""Grading: a student's answers run in a sandbox that holds nothing worth stealing, and are judged outside it.

collect    whose a file is in the zip of a learning platform
reading    a released lab and the submissions of it, read as data of strangers
sandbox    what an answer sees and may use: bubblewrap, `seccomp`, limits, a fresh process
bwrap      which bubblewrap there is, and why it does not work where it does not
worker     the program in the sandbox: takes cells and arguments, sends numbers back
channel    the other end: sends, waits until a deadline, and takes nothing but numbers
grade      one submission: every question, whatever happens in the others
copies     which answers hold the kit's own code
batch      a folder of submissions: what changed is graded
outputs    grades.csv, results.json, and `feedback`, a page per student
markdown   a stranger's Markdown, made harmless
tell       what to say about a wrong answer, in a process with limits
changes    what an instructor changed after the release: course.toml
settings   course.toml, read with line numbers
deadlines  who is late, and what it costs
roster     names and emails
gradebook  nbgrader's database and the copies that formgrader shows
students   those who were renamed, and those who are gone
final      what students have in the end, and the end of their pages
platforms  tables and zips that Moodle and Canvas take back
gradescope an autograder for Gradescope, and what runs in its container
refusal    why nbgrader's own Autograde does nothing
"""
