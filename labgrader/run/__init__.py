"""One worker runs a student's lines: a plain process at the student's, a sandboxed one at the grader's.

process            the program in the worker: runs pieces, calls functions, looks for mistakes, sends numbers back
channel            the other end: sends, waits until its time is up, and takes nothing but numbers and known words
stopwatch          CPU seconds of a worker, by which its time is up
subprocess_worker  starts a worker as a plain process; one is always ready for the next check
limits             what one answer may use
run                an answer on the cases of its question: outputs, the verdict, and what is found in its program
"""
