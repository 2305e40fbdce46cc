"""What goes out: pages and tables for students, the instructor and learning platforms.

alike         answers that are alike beyond what their task forces, of this class and of an earlier one
alike_page    those side by side, for the instructor
outputs       grades.csv, results.json, and `feedback`, a page per student
forget        what is kept out of git, and a student who is to be in no file any more
course_page   all labs together, for the instructor and for platforms
texts         answers in words on one page per question
rendered      Markdown on that page: formatted, and nothing that acts
texts_server  that page in a browser of this machine
second_look   one answer with all its cases and replies, by the key on a student's page
platforms     tables and zips that Moodle and Canvas take back
gradescope    an autograder for Gradescope, and what runs in its container
"""
