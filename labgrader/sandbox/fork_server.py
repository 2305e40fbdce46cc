"""How a sandbox starts workers: a server loads the packages once, and forks a child for each answer.

No student's code runs in the server: a child is killed after its answer, so that what one does to its process is over
before the next one begins. Linux alone has such sandboxes.
"""

import base64
import ctypes
import importlib
import os
import signal
import socket
import struct

from labgrader.run.process import limit, received, send, serve, without_standard_streams


def main(options: dict) -> None:
    """Load packages, then start a child for each pair of pipes that comes, until no more do."""
    for package in options["load"]:
        importlib.import_module(package)
    control = socket.socket(fileno=os.dup(0))
    control.send(b"r")
    while True:
        message, pipes, _, _ = socket.recv_fds(control, 1, 2)
        if not message:
            return
        child = os.fork()
        if child == 0:
            control.send(b"c")  # comes with this process's number as the grader sees it
            control.close()
            with os.fdopen(pipes[0], "rb") as requests, os.fdopen(pipes[1], "wb", buffering=0) as replies:
                try:
                    limit(options)
                    lock_in(options)
                    without_standard_streams()
                except Exception as error:
                    send(replies, b"J" + repr(error).encode())  # nothing of a student has run by now
                    os._exit(1)
                serve(received(requests), replies)
            os._exit(0)
        for pipe in pipes:
            os.close(pipe)
        done = control.recv(1)  # comes when the grader has all that it wants, or wants no more
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        if not done:
            return
        control.send(b"d")


def lock_in(options: dict) -> None:
    """Leave root for good, then give up the system calls that the filter refuses.

    Each pair of sockets is one more that the kernel has numbered, which the next answers see: all get copies of one.
    """
    pair = socket.socketpair()
    socket.socketpair = lambda *kind: tuple(one.dup() for one in pair)
    if options["first_uid"] is not None:
        uid = options["first_uid"] + os.getpid() % options["uids"]
        os.setgroups([])
        os.setgid(uid)
        os.setuid(uid)
    program = base64.b64decode(options["filter"])
    code = ctypes.create_string_buffer(program, len(program))
    head = struct.pack("@HP", len(program) // 8, ctypes.addressof(code))  # struct sock_fprog
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(38, 1, 0, 0, 0) or libc.prctl(22, 2, head, 0, 0):  # no new privileges; filter the system calls
        raise OSError(ctypes.get_errno(), "the filter of system calls cannot be set")
