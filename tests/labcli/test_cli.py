"""The command line: quick to answer, one line for what the user can mend, and training from end to end."""

import errno
import json
import signal
import subprocess
import sys

import pytest
import torch

import data_gen
from labcli import cli, doctor
from labkit.learning.network import UNetRGBD, load_model, save_model

HEAVY = ("torch", "numpy", "cv2", "pybullet", "numba", "matplotlib")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Four tiny frames to train on."""
    folder = tmp_path_factory.mktemp("data") / "train"
    data_gen.generate(folder, range(4), "train", (64, 48), progress=False)
    return folder


def test_help_names_the_commands_and_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['labkit', '--help']\n"
        "from labcli import cli\n"
        "try: cli.main()\n"
        f"finally: print('heavy:', [name for name in {HEAVY} if name in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "doctor" in shown and "train" in shown
    assert shown.splitlines()[-1] == "heavy: []"


def test_every_command_says_what_it_does(labkit, capsys):
    groups = {"": cli.app} | {group.name: group.typer_instance for group in cli.app.registered_groups}
    assert groups.keys() == {"", "node", "new"}
    for name, group in groups.items():
        for command in group.registered_commands:
            words = [name, command.name or command.callback.__name__]
            assert labkit(*filter(None, words), "--help") == 0
            assert command.callback.__doc__.splitlines()[0].split(";")[0] in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    "error, line",
    [
        (ValueError("K: expected (3, 3),\n got (4,)"), "labkit: K: expected (3, 3), got (4,)"),
        (FileNotFoundError(errno.ENOENT, "No such file", "a.pt"), "labkit: a.pt: No such file"),
        (
            OSError(errno.ENOSPC, "No space left on device", "out/demo.png"),
            "labkit: out/demo.png: No space left on device",
        ),
        (ModuleNotFoundError("No module named 'torch'"), "labkit: No module named 'torch'; `labkit doctor` tells"),
    ],
)
def test_what_the_user_can_mend_is_one_line_and_status_2(monkeypatch, labkit, capsys, error, line):
    def fail():
        raise error

    monkeypatch.setattr(doctor, "examine", fail)
    assert labkit("doctor") == 2
    said = capsys.readouterr().err
    assert said.startswith(line) and said.count("\n") == 1
    assert labkit("--debug", "doctor") == 2 and "Traceback" in capsys.readouterr().err
    error = TypeError("a bug")  # a mistake in the program keeps its traceback, and is nothing to look at
    assert labkit("doctor") == 2
    said = capsys.readouterr().err
    assert "Traceback" in said and "TypeError: a bug" in said


@pytest.mark.parametrize("state, status", [(doctor.OK, 0), (doctor.NOTE, 0), (doctor.WRONG, 1)])
def test_doctor_fails_only_when_something_needed_is_missing(monkeypatch, labkit, capsys, state, status):
    monkeypatch.setattr(doctor, "examine", lambda: [doctor.Finding("thing", state, "as it is")])
    assert labkit("doctor") == status
    assert "as it is" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments, name",
    [(["train", "--model", "x"], "model"), (["train", "--epochs", "x"], "--epochs"), (["lift"], "lift")],
)
def test_wrong_usage_is_status_2_and_names_the_option(labkit, capsys, arguments, name):
    assert labkit(*arguments) == 2
    assert name in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, name",
    [
        (["nowhere"], "nowhere"),
        (["--epochs", 0], "epochs"),
        (["--val", "nowhere"], "nowhere"),
        (["--seed", -1], "seed"),
    ],
)
def test_bad_training_arguments_are_named(labkit, capsys, data, tmp_path, arguments, name):
    given = arguments if arguments[0] == "nowhere" else [data, *arguments]
    assert labkit("train", *given, "--out", tmp_path) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("labkit: ") and name in said


def test_train_writes_weights_and_a_second_run_finds_it_done(labkit, capsys, data, tmp_path):
    command = ["train", data, "--val", data, "--epochs", 2, "--device", "cpu", "--out", tmp_path]
    assert labkit(*command) == 0
    assert "2 epochs" in capsys.readouterr().out
    history = json.loads((tmp_path / "unet.history.json").read_text())
    assert [row["epoch"] for row in history] == [1, 2] and "mean_iou" in history[1]
    assert load_model(tmp_path / "unet.pt", 4) is not None
    weights = (tmp_path / "unet.pt").read_bytes()
    assert labkit(*command) == 0
    assert (tmp_path / "unet.pt").read_bytes() == weights
    assert labkit(*command, "--seed", 1) == 2  # not the run that the checkpoint belongs to
    assert "seed" in capsys.readouterr().err
    assert labkit(*command, "--seed", 1, "--no-resume") == 0
    assert (tmp_path / "unet.pt").read_bytes() != weights


def test_training_goes_on_from_given_weights_on_part_of_two_data_sets(labkit, capsys, data, tmp_path):
    """A learning rate of next to nothing leaves the weights as they were; four frames are one batch of eight."""
    start, out = tmp_path / "start.pt", tmp_path / "out"
    save_model(UNetRGBD(), start)
    settings = "--scenes 2 --model unet_rgbd --epochs 1 --device cpu --lr 1e-9"
    command = ["train", data, data, *settings.split()]
    assert labkit(*command, "--init", start, "--out", out) == 0
    assert json.loads((out / "unet_rgbd.history.json").read_text())[0]["steps"] == 1
    trained = dict(load_model(out / "unet_rgbd.pt").named_parameters())
    for name, weight in load_model(start).named_parameters():
        assert torch.allclose(weight, trained[name], atol=1e-6), name
    assert labkit(*command, "--init", "unet", "--out", tmp_path) == 2
    assert "init: expected weights of unet_rgbd, got unet of unet" in capsys.readouterr().err


def test_ctrl_c_ends_training_with_status_130_and_says_where_the_checkpoint_is(data, tmp_path):
    words = ["train", data, "--epochs", 100_000, "--device", "cpu", "--out", tmp_path]
    command = [sys.executable, "-m", "labcli.cli", *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        said = ""
        while "loss" not in said:  # the progress bar shows a loss as soon as a step is done
            character = process.stderr.read(1)
            assert character, said
            said += character
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
    assert process.returncode == 130
    assert (tmp_path / "unet.checkpoint.pt").is_file()
    assert f"goes on from {tmp_path / 'unet.checkpoint.pt'}" in said.splitlines()[-1]
