"""The sagging block of thesis §3.3.2: back to the cube wherever a stable shape under weight exists.

Independent answers: the cube that the forward solve began with, the weight ρ g V in the supports,
eigenvalues of the condensed stiffness by numpy, and for interrupted runs the run that was not.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import supple
from supple.cli import main
from supple.studies import sagging_block, sagging_block_convergence, sagging_block_samples
from supple.studies.sagging_block import NO_FORWARD, NO_REST, SOLVED

WEIGHT = sagging_block.DENSITY * sagging_block.GRAVITY  # N, of 1 m³


@pytest.fixture(scope="module")
def block():
    return sagging_block.Block()


@pytest.mark.parametrize("parameters", sagging_block.PRINTED)
def test_the_cube_comes_back_where_the_thesis_prints_its_error(block, parameters, shared):
    """1e-11 m and below, against 1.21e-9 and 1.21e-5 m; the shortcut misses by far more."""
    text = (shared / "reference/references.json").read_text(encoding="utf-8")
    printed = json.loads(text)["sagging_block"]["thesis_mae_m"].values()
    assert list(printed) == list(sagging_block.PRINTED.values())
    found = block.run(*parameters)
    assert found.outcome == SOLVED
    assert found.mae <= found.largest < 1e-11  # Newton's rtol is 1e-10 of the load
    assert found.reversed_gravity > 1e-5


def test_the_supports_carry_the_weight(block):
    state = block.body.set(mu=2e4, lmbda=3e6).solve()
    held = state.reactions.sum(axis=0)
    np.testing.assert_allclose(held, [0.0, WEIGHT, 0.0], atol=1e-8 * WEIGHT)


def softest(block, mu):
    """Smallest eigenvalue of K_uu + Bᵀ M⁻¹ B over μ, and how far its mode sways."""
    state, n = block.body.set(mu=mu, lmbda=1e6).solve(), block.mesh.points.size
    K = supple.assemble(block.body, state.u, state.pressure)[2].toarray()
    free = np.repeat(block.mesh.points[:, 1] > 1e-9, 3)
    B, M = K[n:, :n][:, free], -K[n:, n:]
    return np.linalg.eigvalsh(K[:n, :n][np.ix_(free, free)] + B.T @ np.linalg.solve(M, B))[0] / mu


@pytest.mark.slow
def test_samples_are_set_apart_where_the_loaded_block_loses_its_stiffness(block):
    """The smallest eigenvalue falls from 2.5e-3 μ at 10 kPa to nothing at 4.7, and none beyond."""
    stiff, soft = softest(block, 1e4), softest(block, 4.7e3)
    assert stiff > 2e-3
    assert 0 < soft < 0.1 * stiff
    found = block.run(4.6e3, 1e6)
    assert found.outcome == NO_FORWARD
    assert found.reason


def test_a_sample_near_the_limit_comes_back(block):
    found = block.run(4.7e3, 1e6)
    assert found.outcome == SOLVED
    assert found.mae <= sagging_block.BAR


def test_samples_are_uniform_in_the_printed_ranges_and_more_begin_with_fewer():
    drawn = sagging_block.draw(4000, 1)
    low, high = np.transpose([sagging_block.MU, sagging_block.LMBDA])
    share = (drawn - low) / (high - low)
    assert ((share >= 0) & (share <= 1)).all()
    for column in share.T:  # Kolmogorov and Smirnov's distance, 1.63 / √n at the level of 1 %
        assert abs(np.sort(column) - np.arange(4000) / 4000).max() < 1.63 / np.sqrt(4000)
    np.testing.assert_array_equal(sagging_block.draw(10, 1), drawn[:10])
    assert not np.array_equal(sagging_block.draw(10, 2), drawn[:10])


@pytest.mark.slow
def test_a_stopped_run_is_resumed_to_the_table_of_one_that_was_not(tmp_path):
    def stop(share):
        if share > 0.3:
            raise KeyboardInterrupt

    run, name = sagging_block_samples.run, sagging_block_samples.TABLE
    whole, seconds = run(tmp_path / "whole" / name, 5, seed=3, jobs=2)
    assert len(seconds) == 5
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "cut" / name, 5, seed=3, jobs=1, progress=stop)
    with (tmp_path / "cut" / name).open("a", encoding="utf-8") as file:
        file.write("4,3,torn")
    resumed, seconds = run(tmp_path / "cut" / name, 5, seed=3, jobs=1, resume=True)
    assert len(seconds) == 3
    assert resumed.table() == whole.table()
    assert max(sagging_block_samples.column(whole, "mae_m")) <= sagging_block.BAR


@pytest.mark.slow
def test_ctrl_c_leaves_a_table_that_the_command_resumes(tmp_path):
    """A signal to the whole group, as a terminal's; 130, then the table of an unbroken run."""
    table = tmp_path / "out" / sagging_block_samples.TABLE
    arguments = ["study", "sagging-block", "--samples", "12", "--jobs", "1", "--out"]
    words = [sys.executable, "-m", "supple", *arguments, str(table.parent)]
    process = subprocess.Popen(
        words, stderr=subprocess.PIPE, text=True, start_new_session=True, env=dict(os.environ),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's "&" ignores it
    )  # fmt: skip
    while process.poll() is None and (not table.exists() or table.read_bytes().count(b"\n") < 3):
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "--resume goes on" in said
    assert "Traceback" not in said
    assert 3 <= table.read_bytes().count(b"\n") < 13
    assert [path.name for path in table.parent.iterdir()] == [table.name]
    assert main([*arguments, str(table.parent), "--resume"]) == 0
    whole, _ = sagging_block_samples.run(tmp_path / "whole.csv", 12, seed=1, jobs=2)
    assert table.read_text(encoding="utf-8") == whole.table()


def test_the_study_writes_its_files_and_exits_3_beyond_the_bar(tmp_path, monkeypatch):
    words = ["study", "sagging-block", "--samples", "2", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    names = [f"sagging_block.{suffix}" for suffix in ("csv", "png", "svg")]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["result.json", *names]
    assert main(words) == 2  # a table is there
    assert main([*words, "--resume", "--seed", "2"]) == 2
    assert main([*words, "--resume", "--samples", "1"]) == 2
    monkeypatch.setattr(sagging_block_samples, "BAR", 0.0)
    assert main([*words, "--resume"]) == 3
    found = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert (found["samples"], found["solved"], found["above_bar"]) == (2, 2, 2)
    assert [point["thesis_mae_m"] for point in found["thesis"]] == [1.21e-9, 1.21e-5]


@pytest.mark.parametrize(
    "words", [["--samples", "0"], ["--jobs", "-1"], ["--seed", "-1"], ["--samples", "many"]]
)
def test_wrong_options_end_with_2(tmp_path, words):
    assert main(["study", "sagging-block", *words, "--out", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_a_study_takes_no_option_of_another(tmp_path, capsys):
    assert main(["study", "hanging-dome", "--samples", "3", "--out", str(tmp_path / "out")]) == 2
    assert "hanging-dome takes no --samples" in capsys.readouterr().err


def test_failures_are_counted_apart_from_samples_that_have_no_loaded_shape(tmp_path):
    journal = sagging_block_samples.Journal(tmp_path / "t.csv", sagging_block_samples.COLUMNS)
    start = [3, 1e4, 1e6]
    journal.append([0, *start, SOLVED, "1e-17", "1e-16", "1e-3", "0.1", "0.9", 3, 3, ""])
    journal.append([1, *start, NO_FORWARD, *[""] * 5, 0, 0, "it buckles"])
    journal.append([2, *start, NO_REST, "", "", "", "0.1", "0.9", 0, 0, "it folds"])
    journal.append([3, *start, SOLVED, "2e-9", "1e-8", "", "0.1", "0.9", 3, 3, ""])
    found = sagging_block_samples.summary(journal)
    assert (found["solved"], found["without_stable_forward_solution"], found["failed"]) == (2, 1, 1)
    assert found["reasons"] == {"it buckles": 1}
    assert (found["largest_mae_m"], found["above_bar"]) == (2e-9, 1)
    assert found["reversed_gravity"] == {
        "failed": 1,
        "mean_mae_m": 1e-3,
        "largest_mae_m": 1e-3,
    }


@pytest.mark.slow
def test_refined_meshes_agree_on_how_far_the_top_sinks():
    """P2 and the mixed pair within 1 % at 5 cubes; P1 locks at ν = 0.497 and stays behind."""
    rows = sagging_block_convergence.run(cubes=(2, 5))
    sag = {(row.name, row.cubes): row.found.sag for row in rows}
    mixed = sag["P2–P1 mixed", 5]
    assert sag["P2", 5] == pytest.approx(mixed, rel=0.025)
    assert sag["P2–P1 mixed", 2] == pytest.approx(mixed, rel=0.05)
    assert sag["P1", 2] < sag["P1", 5] < 0.8 * mixed
    assert all(row.found.mae <= sagging_block.BAR for row in rows)
