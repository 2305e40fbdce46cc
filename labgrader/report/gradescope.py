"""An autograder for Gradescope: `grades LAB --gradescope` writes its zip, and this module runs in its container.

Their container is the sandbox there. In it, answers run as other users, who can read neither the kit nor the secret
seed nor the results, and under the same limits and filter of system calls as in bubblewrap.
"""

import datetime
import json
import os
import shutil
import stat
import sys
import zipfile
from importlib import metadata
from pathlib import Path

from labgrader.course import FILE as PROJECT
from labgrader.course import course as course_here
from labgrader.course import files_of
from labgrader.grade.batch import SECRET_FILE, Batch, grade_batch
from labgrader.grade.changes import CHANGES, changed, read_changes
from labgrader.grade.deadlines import Lateness, read_deadline
from labgrader.grade.overview import COMMENTS_FILE, read_comments
from labgrader.grade.policy import read_policy
from labgrader.grade.totals import OFF
from labgrader.handin.reading import read_lab, read_submission
from labgrader.handin.several import read_picks
from labgrader.report.outputs import gradescope
from labgrader.sandbox.sandbox import Limits
from labgrader.settings import FILE
from labgrader.support import write_atomically

SETUP = """#!/bin/sh
# Gradescope runs this once, as root, to build the image.
set -e
TORCH_INDEX=""  # the address of PyTorch's CPU builds saves 2 GB
apt-get update
for python in python3.13 python3.12 python3.11; do
    apt-get install -y --no-install-recommends $python $python-venv && break
done
$python -m venv /usr/local/grader
cd /autograder/source
/usr/local/grader/bin/pip install ${TORCH_INDEX:+--extra-index-url "$TORCH_INDEX"} -r requirements.txt
"""
RUN = """#!/bin/sh
# Gradescope runs this for each submission, as root.
set -e
umask 077
chmod 700 /autograder
cd /autograder/source
exec /usr/local/grader/bin/python -m labgrader.report.gradescope {topic} /autograder
"""


def write_autograder(course: Path, topic: str) -> Path:
    """Write grades/TOPIC/gradescope.zip, which grades as `grade` does in the round that it began.

    Raises ValueError if there is no released lab or no round of grading, or if course.toml cannot be used.
    """
    course = Path(course)
    lab, out, kit = read_lab(course, topic), course / "grades" / topic, course_here()
    read_changes(course, lab)
    if not (out / SECRET_FILE).is_file():
        raise ValueError(f"topic: expected a round of grading in {out}; `{kit.command} grade {topic}` begins one")
    needed = [f"{name}=={metadata.version(name).partition('+')[0]}\n" for name in (*kit.packages, "packaging", "tqdm")]
    texts = {"setup.sh": SETUP, "run_autograder": RUN.format(topic=topic), "requirements.txt": "".join(needed)}
    rooms = dict.fromkeys(("labgrader", kit.questions.partition(".")[0], *kit.copied))
    kinds = ("*.py", "*.toml")  # a question's hints in another language stand beside it
    files = {name: path for room in rooms for kind in kinds for name, path in files_of(room, kind)}
    files |= {PROJECT: kit.file}
    files |= {f"labs/{topic}/{topic}.ipynb": course / "labs" / topic / f"{topic}.ipynb"}
    files |= {name: course / name for name in (FILE, CHANGES)}
    files |= {name: out / name for name in (SECRET_FILE, COMMENTS_FILE)}
    target = out / "gradescope.zip"
    unfinished = target.with_suffix(".unfinished")
    with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
        contents = {name: path.read_bytes() for name, path in files.items() if path.is_file()}
        for name, content in ({name: text.encode() for name, text in texts.items()} | contents).items():
            info = zipfile.ZipInfo(name)
            info.external_attr = (stat.S_IFREG | (0o700 if name in ("setup.sh", "run_autograder") else 0o600)) << 16
            archive.writestr(info, content)
    os.replace(unfinished, target)
    return target


def grade(topic: str, place: Path) -> str:
    """Grade PLACE/submission with what lies in PLACE/source; returns Gradescope's results.json."""
    course, work, told = place / "source", place / "work", read_metadata(place / "submission_metadata.json")
    shutil.rmtree(work, ignore_errors=True)
    student = student_of(told)
    lab = read_lab(course, topic)
    gather(place / "submission", work / student / topic)
    submission = read_submission(work / student, lab, next(iter(picks_of(course, topic, told)), ""))
    if submission.reason:
        raise ValueError(submission.reason)
    secret = (course / SECRET_FILE).read_text().strip()
    batch = Batch(lab, [submission], work, secret, limits=Limits(container=True))
    lab, (record,) = changed(lab, grade_batch(batch, progress=False)[0], read_changes(course, lab))
    results = json.loads(gradescope(lab, record, read_comments(course)))
    late, said = lateness(course, topic, told), [results["output"]]
    if submission.note:
        said.append(f"{submission.note[:1].upper()}{submission.note[1:]}.")
    if late.days:
        results["score"] = round(results["score"] * (1.0 - late.percent / 100.0), 4)
        said.append(f"Handed in {late}.{f' {OFF}' if late.percent else ''}")
    return json.dumps(results | {"output": "\n".join(filter(None, said))}, indent=1) + "\n"


def gather(handed_in: Path, folder: Path) -> None:
    """Copy what was handed in into one folder, notebooks or whatever came instead."""
    folder.mkdir(parents=True)
    for path in sorted(handed_in.rglob("*")):
        hidden = any(part.startswith((".", "__")) for part in path.relative_to(handed_in).parts)
        if path.is_file() and not path.is_symlink() and not hidden and path.name != "timestamp.txt":
            target = folder / path.name
            while target.exists():
                target = target.with_name(f"{target.stem} again{target.suffix}")
            shutil.copyfile(path, target)


def read_metadata(path: Path) -> dict:
    """What Gradescope says of a submission, {} if nothing that can be read."""
    try:
        told = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return told if isinstance(told, dict) else {}


def users_of(told: dict) -> list[dict]:
    """Those who handed in: a group may have several."""
    users = told.get("users")
    return [user for user in users if isinstance(user, dict)] if isinstance(users, list) else []


def student_of(told: dict) -> str:
    """A name for who handed in, the same each time."""
    users = sorted(str(user.get("id")) for user in users_of(told))
    return "student" + "".join(f"-{user}" for user in users if user.isalnum())[:100]


def names_of(told: dict) -> list[str]:
    """What course.toml may call those who handed in: by email, by the number of a university's or of Gradescope's."""
    return [str(user[key]) for user in users_of(told) for key in ("email", "sid", "id") if user.get(key)]


def picks_of(course: Path, topic: str, told: dict) -> list[str]:
    """The notebooks that a person named for those who handed in."""
    picks = read_picks(course, topic)
    return [picks[name] for name in names_of(told) if name in picks]


def lateness(course: Path, topic: str, told: dict) -> Lateness:
    """How late it was handed in, under the deadline and the extensions that course.toml had when the zip was made.

    Free late days are not known there, since other labs use them, too: with these nothing is taken off.
    """
    deadline = read_deadline(course, topic)
    try:
        handed_in = datetime.datetime.fromisoformat(str(told["created_at"])).astimezone(datetime.UTC)
    except (KeyError, ValueError):
        return Lateness()
    if deadline is None or read_policy(course).late_days:
        return Lateness()
    names = [name for name in names_of(told) if name in deadline.extensions]
    return deadline.lateness(names[0] if names else "", handed_in.replace(tzinfo=None))


def main(topic: str, place: str) -> None:
    """Write results/results.json; what a student can mend is said there."""
    try:
        results = grade(topic, Path(place))
    except ValueError as error:
        results = json.dumps({"score": 0.0, "output": f"This submission could not be graded: {error}."})
    write_atomically(Path(place) / "results" / "results.json", results.encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
