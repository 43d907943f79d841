"""Exit codes, messages, JSON and cleanliness that every command shares."""

from __future__ import annotations

import contextlib
import errno
import json
import signal
import subprocess
import sys
import time
import types
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import pytest

import supple.cli
from supple.cli import main
from supple.cli._run import Run, command
from supple.errors import ConvergenceError, InputError, MaterialError, MeshError

Work = Callable[[Run], None]
Install = Callable[[Work], None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Makes a function the one command of `supple`, named "probe"."""

    def put(work: Work) -> None:
        def probe(run: Run) -> None:
            """A command for tests."""
            work(run)

        module = types.ModuleType("supple.cli.probe")
        vars(module)["probe"] = command(probe)
        monkeypatch.setitem(sys.modules, "supple.cli.probe", module)
        monkeypatch.setattr(supple.cli, "COMMANDS", ("probe",))

    return put


def raising(error: BaseException) -> Work:
    def work(run: Run) -> None:
        run.path("half.txt").write_text("half")
        raise error

    return work


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("The file is missing; name another."), 2),
        (MaterialError("There is no law x."), 2),
        (MeshError("Cell 3 is inverted."), 2),
        (ConvergenceError("No equilibrium.", cause="unconstrained body"), 3),
        (KeyboardInterrupt(), 130),
    ],
)
@pytest.mark.parametrize("flags", [[], ["--json"]])
def test_an_error_gives_its_exit_code_one_sentence_and_no_file(
    install: Install,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    flags: list[str],
) -> None:
    install(raising(error))
    assert main(["probe", "--out", str(tmp_path / "out"), *flags]) == code
    assert list(tmp_path.iterdir()) == []
    shown = capsys.readouterr()
    if code == 130:
        assert shown.err.strip() == "supple: interrupted, nothing was written"
    elif flags:
        described = json.loads(shown.out)["error"]
        assert described["type"] == type(error).__name__
        assert described["message"] == str(error)
    else:
        assert (shown.out, shown.err) == ("", f"supple: {error}\n")


def test_a_failed_solve_tells_its_history_in_json(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    history = [{"step": 1, "residual": np.float64(2.5)}, {"step": 2, "residual": float("nan")}]
    install(raising(ConvergenceError("No.", history, np.array([4, 2]), 0.4, "inverted cell")))
    assert main(["probe", "--json", "--out", str(tmp_path / "out")]) == 3
    assert json.loads(capsys.readouterr().out)["error"] == {
        "type": "ConvergenceError",
        "message": "No.",
        "cause": "inverted cell",
        "load_factor": 0.4,
        "cells": [4, 2],
        "history": [{"step": 1, "residual": 2.5}, {"step": 2, "residual": None}],
    }


def test_an_unexpected_exception_is_not_swallowed_and_leaves_no_file(
    install: Install, tmp_path: Path
) -> None:
    install(raising(ZeroDivisionError("a fault of ours")))
    with pytest.raises(ZeroDivisionError):
        main(["probe", "--out", str(tmp_path / "out")])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("flags", [[], ["--json"]])
def test_an_unknown_option_is_bad_input(
    install: Install, capsys: pytest.CaptureFixture[str], flags: list[str]
) -> None:
    install(lambda run: None)
    assert main(["probe", "--outt", "x", *flags]) == 2
    shown = capsys.readouterr()
    if flags:
        assert json.loads(shown.out)["error"]["type"] == "NoSuchOption"
    else:
        assert "--outt" in shown.err


def good(run: Run) -> None:
    run.path("a.txt").write_text("a")
    run.say("The tip moved by 2 mm.")
    run.result["tip_mm"] = np.array([0.0, np.inf, 2.0])


def test_a_good_run_writes_its_files_and_the_result(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(good)
    assert main(["probe", "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "a.txt").read_text(encoding="utf-8") == "a"
    written = (tmp_path / "out" / "result.json").read_text(encoding="utf-8")
    assert json.loads(written) == {"tip_mm": [0, None, 2]}
    shown = capsys.readouterr()
    assert shown.out == f"The tip moved by 2 mm.\nwrote {tmp_path / 'out'}: a.txt, result.json\n"
    assert shown.err == ""


def test_json_is_all_that_stdout_gets(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(good)
    assert main(["probe", "--out", str(tmp_path / "out"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"tip_mm": [0, None, 2]}


def test_a_doubtful_result_is_written_marked_and_exits_3(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(run: Run) -> None:
        good(run)
        run.doubt("one cell is inverted")

    install(work)
    assert main(["probe", "--out", str(tmp_path / "out")]) == 3
    written = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert written["not_trustworthy"] == ["one cell is inverted"]
    assert "supple: not trustworthy: one cell is inverted\n" in capsys.readouterr().err


@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_in_mid_run_leaves_no_file(tmp_path: Path, sent: int, code: int) -> None:
    program = """
import signal, sys, time, types
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background ignores it
import supple.cli
from supple.cli._run import command

@command
def probe(run):
    run.path("half.txt").write_text("half")
    print("working", flush=True)
    time.sleep(60)

sys.modules["supple.cli.probe"] = module = types.ModuleType("probe")
module.probe = probe
supple.cli.COMMANDS = ("probe",)
sys.exit(supple.cli.main(["probe", "--out", sys.argv[1]]))
"""
    arguments = [sys.executable, "-c", program, str(tmp_path / "out")]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "working\n"
        running.send_signal(sent)
        assert running.wait(timeout=20) == code
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("stage", [True, False])
def test_a_signal_that_a_library_swallows_stops_the_run_at_its_next_stage(
    install: Install, tmp_path: Path, sent: signal.Signals, code: int, stage: bool
) -> None:
    """As an import does that catches all; a run without stages stops before it is written."""

    def work(run: Run) -> None:
        run.path("half.txt").write_text("half")
        with contextlib.suppress(BaseException):
            signal.raise_signal(sent)
        if stage:
            run.progress("next")
            pytest.fail("the run went on")

    install(work)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        got = _code_of(["probe", "--out", str(tmp_path / "out")])
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert got == code
    assert list(tmp_path.iterdir()) == []


def _code_of(arguments: list[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as left:
        return int(str(left.code))


def test_a_full_disk_is_said_and_nothing_stays(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(raising(OSError(errno.ENOSPC, "No space left on device")))
    assert main(["probe", "--out", str(tmp_path / "out")]) == 2
    assert "no room is left on the disk" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def seconds_of_help() -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "supple", "--help"], check=True, capture_output=True)
    return time.perf_counter() - start


def test_help_takes_at_most_half_a_second() -> None:
    assert min(seconds_of_help() for _ in range(3)) <= 0.5


def test_every_listed_command_has_help_out_and_json() -> None:
    for name in supple.cli.COMMANDS:
        found = supple.cli._main.supple.get_command(click.Context(click.Command("supple")), name)
        assert found is not None
        assert found.name == name
        assert found.help, f"{name} needs a docstring: it is the help"
        assert {"out", "as_json"} <= {option.name for option in found.params}
