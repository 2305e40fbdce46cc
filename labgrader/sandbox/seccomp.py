"""The system calls that an answer is refused, as the filter program that the kernel takes (seccomp, classic BPF).

Namespaces and limits leave some ways to use up a machine: more processes, memory that belongs to no process (shared
memory segments, file systems of a new user namespace), slots that all processes share (asynchronous input and output),
and the kernel's less trodden corners. Others would let one answer leave something for the next in the same sandbox:
signals and limits of other processes, sockets, whose ports stay in use for a minute, locks, watches, times and hints on
files that all can read, which pages of these are in memory, and what the kernel counts for all: it numbers pipes and
sockets, and says its load. Answers need none of these, so they fail here with EPERM. Threads stay allowed.
"""

import errno
import platform
import re
import struct

# audit number of the architecture; numbers of its system calls, x86-64 and arm64
MACHINES = {"x86_64": (0xC000003E, 0), "aarch64": (0xC00000B7, 1)}
# By what they would let an answer do: name, then its numbers on the two architectures, - where there is none.
REFUSED = """
processes:   fork 57 -, vfork 58 -, kill 62 129, tkill 200 130, tgkill 234 131, rt_sigqueueinfo 129 138,
             rt_tgsigqueueinfo 297 240, pidfd_open 434 434, pidfd_getfd 438 438, pidfd_send_signal 424 424,
             ptrace 101 117, process_vm_readv 310 270, process_vm_writev 311 271, process_madvise 440 440,
             process_mrelease 448 448, kcmp 312 272, setpriority 141 140, ioprio_set 251 30, sched_setaffinity 203 122,
             sched_setscheduler 144 119, sched_setparam 142 118, sched_setattr 314 274
namespaces:  unshare 272 97, setns 308 268, mount 165 40, umount2 166 39, pivot_root 155 41, chroot 161 51,
             open_tree 428 428, move_mount 429 429, fsopen 430 430, fsmount 432 432
memory:      shmget 29 194, semget 64 190, msgget 68 186, mq_open 240 180, memfd_create 319 279, memfd_secret 447 447,
             migrate_pages 256 238, move_pages 279 239
pages:       fadvise64 221 223, readahead 187 213, mincore 27 232, cachestat 451 451, preadv2 327 286, pwritev2 328 287,
             sync 162 81, syncfs 306 267, fsync 74 82, fdatasync 75 83, sync_file_range 277 84, msync 26 227
files:       flock 73 32, inotify_init 253 -, inotify_init1 294 26, inotify_add_watch 254 27, fanotify_init 300 262,
             fanotify_mark 301 263, name_to_handle_at 303 264, open_by_handle_at 304 265, utime 132 -, utimes 235 -,
             futimesat 261 -, utimensat 280 88
the kernel:  keyctl 250 219, add_key 248 217, request_key 249 218, bpf 321 280, perf_event_open 298 241,
             io_uring_setup 425 425, io_setup 206 0, userfaultfd 323 282, socket 41 198, syslog 103 116
counters:    pipe 22 -, pipe2 293 59, socketpair 53 199, sysinfo 99 179
"""
PRLIMIT = (302, 261)  # refused for any process but the own one, which has the number 0 here
# Calls that are refused for some values of an argument: numbers of the call, the argument, the values; and those that
# are refused for all values but some. Of an argument its lower half counts, as these calls take an int.
# madvise that moves pages in or out: MADV_WILLNEED, MADV_COLD, MADV_PAGEOUT, MADV_POPULATE_READ, MADV_POPULATE_WRITE.
# fcntl may F_DUPFD, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_DUPFD_CLOEXEC, and ioctl TCGETS, FIONREAD, FIONBIO, FIONCLEX,
# FIOCLEX: others lock, watch or mark the file that is open, as F_SET_RW_HINT and EXT4_IOC_PRECACHE_EXTENTS do.
REFUSED_VALUES = (((28, 233), 3, (3, 20, 21, 22, 23)),)
ALLOWED_VALUES = (
    ((72, 25), 2, (0, 1, 2, 3, 4, 1030)),
    ((16, 29), 2, (0x5401, 0x541B, 0x5421, 0x5450, 0x5451)),
)
CLONE, CLONE3 = (56, 220), (435, 435)
CLONE_THREAD = 0x00010000
X32_CALLS = 0x40000000  # the x32 calls of an x86-64 kernel: other numbers for the same things

LOAD, JUMP_IF_EQUAL, JUMP_IF_GREATER_EQUAL, JUMP_IF_SET, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
NUMBER, ARCHITECTURE, FIRST_ARGUMENT = 0, 4, 16  # where they stand in struct seccomp_data; 8 bytes an argument
ALLOW, KILL = 0x7FFF0000, 0x80000000


def refuse(code: int) -> int:
    """The filter's answer that lets a call fail with an errno."""
    return 0x00050000 | code


def program(machine: str | None = None) -> bytes:
    """Assemble the filter for a machine, this one by default; raises ValueError for one whose calls it does not know.

    >>> len(program("x86_64")) % 8
    0
    """
    machine = platform.machine() if machine is None else machine
    if machine not in MACHINES:
        raise ValueError(f"machine: expected {' or '.join(MACHINES)} for the sandbox, got {machine}")
    audit, column = MACHINES[machine]
    lines = [(LOAD, 0, 0, ARCHITECTURE), (JUMP_IF_EQUAL, 1, 0, audit), (RETURN, 0, 0, KILL), (LOAD, 0, 0, NUMBER)]
    if machine == "x86_64":
        lines += [(JUMP_IF_GREATER_EQUAL, 0, 1, X32_CALLS), (RETURN, 0, 0, KILL)]
    for numbers in re.findall(r"\w+ (\d+) (\d+|-)", REFUSED):
        if numbers[column] != "-":
            lines += [(JUMP_IF_EQUAL, 0, 1, int(numbers[column])), (RETURN, 0, 0, refuse(errno.EPERM))]
    lines += [(JUMP_IF_EQUAL, 0, 4, PRLIMIT[column]), (LOAD, 0, 0, FIRST_ARGUMENT), (JUMP_IF_EQUAL, 0, 1, 0)]
    lines += [(RETURN, 0, 0, ALLOW), (RETURN, 0, 0, refuse(errno.EPERM))]
    no, yes = refuse(errno.EPERM), ALLOW
    by_value = [(*one, no, yes) for one in REFUSED_VALUES] + [(*one, yes, no) for one in ALLOWED_VALUES]
    for call, position, values, if_listed, if_not in by_value:
        argument = FIRST_ARGUMENT + 8 * (position - 1)
        lines += [(JUMP_IF_EQUAL, 0, 2 * len(values) + 2, call[column]), (LOAD, 0, 0, argument)]
        for value in values:
            lines += [(JUMP_IF_EQUAL, 0, 1, value), (RETURN, 0, 0, if_listed)]
        lines += [(RETURN, 0, 0, if_not)]
    # The flags of clone3 are in memory, where a filter cannot look; told that there is no such call, libc uses clone.
    lines += [(JUMP_IF_EQUAL, 0, 1, CLONE3[column]), (RETURN, 0, 0, refuse(errno.ENOSYS))]
    lines += [(JUMP_IF_EQUAL, 1, 0, CLONE[column]), (RETURN, 0, 0, ALLOW), (LOAD, 0, 0, FIRST_ARGUMENT)]
    lines += [(JUMP_IF_SET, 0, 1, CLONE_THREAD), (RETURN, 0, 0, ALLOW), (RETURN, 0, 0, refuse(errno.EPERM))]
    return b"".join(struct.pack("=HBBI", *line) for line in lines)
