"""A sandbox that holds nothing worth stealing: what an answer sees and may use there.

sandbox      what a worker sees and may use: bubblewrap, `seccomp`, limits, a fresh process (`labgrader.run`)
bwrap        which bubblewrap there is, and why it does not work where it does not
fork_server  how a sandbox starts a worker: a server that loads the packages once and forks
seccomp      the system calls that an answer is refused
"""
