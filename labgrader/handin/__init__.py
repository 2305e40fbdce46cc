"""What comes in: zips, an exchange, a roster, notebooks of strangers.

collect   whose a file is in the zip of a learning platform
exchange  what `nbgrader collect` takes from a hub's exchange
reading   a released lab and the submissions of it, read as data of strangers
several   which of a student's notebooks is graded
pictures  what is attached to answers in words
astray    answers in words beside the cell that is theirs
roster    names and emails
"""
