"""What is wrong with an answer, and what is said of it; it knows no topic.

judge       the verdict: from the outputs of all cases to words for a student
listed      which listed mistake gives these outputs
sentences   what is said, in order: the surest sentence that is true
errors      what an exception means in this task
messages    a case and a student's lines in words
relations   what wrong outputs have to do with the right ones
finding     a place in a student's program, and what is to be said of it
watches     an answer runs again under a watch that shows where something goes wrong
idle        what stands idle in a program
repair      the place that, written otherwise, makes every case right: `mutation` by `recipes`
repair_job  one look at a program, in its worker: watches, then repair
syntax      places in a syntax tree
alarm       a limit on the CPU time of a call in this process
"""
