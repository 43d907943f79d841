"""A template as a glTF 2.0 file, which carries skin, bones and blendshapes into Blender."""

from __future__ import annotations

from pathlib import Path

from supple.errors import InputError
from supple.files import existing, replacing
from supple.registration.template import Template

_FORMATS = (".glb", ".gltf")


def write_template(template: Template, path: str | Path) -> Path:
    """Write a template as ``.glb``, or as ``.gltf`` with its numbers inside; whole or not at all.

    glTF is in metres with y up and z to the front: LPS (x, y, z) is written as (x, z, −y). Points,
    joints, weights and blendshapes are float32, so that they come back within 6e-8 of their size
    (3e-8 m on a torso); bounds, landmarks, curves, regions and mirror come back exactly. What is
    symmetric stays so exactly. A template that was read is written and read again unchanged, but
    for its weights, whose sum is made 1 on reading.

    Raises:
        InputError: another ending, or no such folder.
    """
    from supple.registration.gltf_write import document, packed

    file = _checked(Path(path))
    data = packed(document(template), embedded=file.suffix.lower() == ".gltf")
    with replacing(file) as aside:
        aside.write_bytes(data)
    return file


def read_template(path: str | Path) -> Template:
    """Read what `write_template` wrote, or what Blender made of it with custom properties kept.

    ``.gltf`` only with its numbers inside. Bones come in the order of BONES, joints from the bind
    pose. Vertices and triangles must keep their order, which landmarks and mirror count in.

    Raises:
        InputError: no such file, no glTF 2.0, or one without a template's skin or drawing.
        MeshError: arrays that are cut off or contradict each other.
    """
    from supple.registration.gltf_read import opened, template

    file = existing(_checked(Path(path)))
    return template(*opened(file), file)


def _checked(file: Path) -> Path:
    if file.suffix.lower() not in _FORMATS:
        raise InputError(f"a template's file must end in {' or '.join(_FORMATS)}, as what `supple "
                         f"template make` writes, got {str(file)!r}.")  # fmt: skip
    return file
