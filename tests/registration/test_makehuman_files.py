"""Folders that are not MakeHuman's: what is missing or spoilt is named."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from supple.errors import InputError
from supple.registration.makehuman import torso

#: Files that the torso is made from, and one line of each that spoils it.
_SPOILT = {
    "3dobjs/base.obj": ("g body\nf 1/1 2/2 3/3\n", "must have a group 'body' of quads"),
    "targets/breast/breast-trans-up.target": ("7 0.1 0.2\n", "must hold 4 numbers a line"),
    "targets/stomach/stomach-navel-in.target": ("99999 0 0 1\n", "must name vertices 0 to"),
    "rigs/default_weights.mhw": ("}{", "must be JSON with 'weights'"),
    "rigs/default.mhskel": ("}{", "must be JSON with 'joints'"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", _SPOILT)
def test_a_folder_that_is_not_makehuman_is_refused(shared, tmp_path, name):
    """A file missing, empty or spoilt is named, with what it must be."""
    folder = tmp_path / "makehuman"
    shutil.copytree(shared / "data/template_makehuman", folder, copy_function=_link)
    file = folder / name
    text = file.read_text()
    line, said = _SPOILT[name]
    for content, message in ((None, "no file at"), ("", "is empty"), (text + line, said)):
        file.unlink(missing_ok=True)
        if content is not None:
            file.write_text(content)
        with pytest.raises(InputError, match=message) as caught:
            torso(folder)
        assert Path(name).name in str(caught.value)


def _link(source: str, target: str) -> None:
    Path(target).symlink_to(source)
