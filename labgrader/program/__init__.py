"""A student's program: cut out of a notebook, which is a stranger's, and run where nothing is worth stealing.

cell           a code cell as statements that know which names they bind, change and need
slice          from a notebook to the program that answers one question
live           a program that runs in this process, in a worker
notebook       what a notebook's file may be to be graded
open_notebook  the notebook that this kernel runs
fingerprint    fingerprints of functions, by which copies of the kit's are known
"""
