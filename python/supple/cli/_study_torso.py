"""`supple study torso`."""

from __future__ import annotations

from pathlib import Path

from ._run import Run


def torso(run: Run, data: Path | None = None, samples: int = 3) -> None:
    """Errors of a registered torso over landmarks, blendshapes and weights."""
    from ..studies import torso as study

    written = study.run(run.path("torso_landmarks.csv").parent, samples, data, run.progress)
    run.result["files"] = [path.name for path in written]
    for path in written:
        run.say(path.name)
