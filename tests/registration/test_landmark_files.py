"""Landmarks from files: names, frames and units are found and said, or refused with a remedy.

The files are written here, by hand, after the public descriptions of their formats.
"""

from __future__ import annotations

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.landmark_check import check_on_scan
from supple.registration.landmark_files import read_landmarks
from supple.registration.landmark_names import landmark_name
from supple.registration.landmark_writing import write_landmarks
from supple.registration.template import LANDMARKS
from supple.surface import Surface

# LPS, mm.
POINTS = {
    "nipple_left": [95.5, -120.25, 310.0],
    "nipple_right": [-93.0, -118.5, 312.75],
    "sternal_notch": [1.5, -70.125, 480.0],
}

FCSV = """# Markups fiducial file version = 4.11
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,95.5,-120.25,310,0,0,0,1,1,1,0,nipple L,,,2,0
2,-93,-118.5,312.75,0,0,0,1,1,1,0,"right nipple, tip",,vtkMRMLModelNode4
3,1.5,-70.125,480,0,0,0,1,1,1,0,jugulum,,
"""
FCSV_410 = """# Markups fiducial file version = 4.10
# CoordinateSystem = 0
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
vtkMRMLMarkupsFiducialNode_0,-95.5,120.25,310.0,0.000,0.000,0.000,1.000,1,1,0,nipple_left,,
vtkMRMLMarkupsFiducialNode_1,93.0,118.5,312.75,0.000,0.000,0.000,1.000,1,1,0,nipple_right,,
vtkMRMLMarkupsFiducialNode_2,-1.5,70.125,480,0.000,0.000,0.000,1.000,1,1,0,sternal_notch,,
"""
FCSV_3 = """# Fiducial List file F.fcsv
# columns = label,x,y,z,sel,vis
nipple_left,-95.5,120.25,310,1,1
nipple_right,93,118.5,312.75,1,1
sternal_notch,-1.5,70.125,480,1,1
"""
JSON = """{"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/\
Resources/Schema/markups-schema-v1.0.3.json#", "markups": [{"type": "Fiducial",
"coordinateSystem": "RAS", "coordinateUnits": ["um", "UCUM", "micrometer"], "locked": false,
"controlPoints": [
{"id": "1", "label": "nipple-left", "position": [-95500, 120250, 310000],
 "positionStatus": "defined"},
{"id": "2", "label": "NippleRight", "position": [93000, 118500, 312750]},
{"id": "3", "label": "suprasternal notch", "position": [-1500, 70125, 480000]},
{"id": "4", "label": "xiphoid", "positionStatus": "undefined"}]}]}
"""
PP = """<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData>
  <DateTime time="16:00:00" date="2014-12-31"/>
  <User name="someone"/>
  <DataFileName name="scan.ply"/>
 </DocumentData>
 <point x="95.5" y="-120.25" z="310" active="1" name="Lt nipple"/>
 <point x="-93" y="-118.5" z="312.75" active="1" name="R. nipple"/>
 <point x="1.5" y="-70.125" z="480" name="sternal notch"/>
 <point x="0" y="0" z="0" active="0" name="xiphoid"/>
</PickedPoints>
"""
CSV = """# frame LPS, unit cm
name,x,y,z
Nipple (left),9.55,-12.025,31.0
nipple right,-9.3,-11.85,31.275
sternal notch,.15,-7.0125,48
"""
SLICER_CSV = """label,r,a,s,defined,selected,visible,locked,description
nipple_left,-95.5,120.25,310,1,1,1,0,
nipple_right,93,118.5,312.75,1,1,1,0,
sternal_notch,-1.5,70.125,480,1,1,1,0,
"""
SEMICOLONS = "landmark;x [m];y [m];z [m]\n" + "".join(
    f"{name};{x / 1e3};{y / 1e3};{z / 1e3}\n" for name, (x, y, z) in POINTS.items()
)
BARE = "".join(f"{name},{x},{y},{z}\n" for name, (x, y, z) in POINTS.items())


def read(tmp_path, suffix, text, **options):
    path = tmp_path / f"landmarks{suffix}"
    path.write_text(text, encoding="utf-8")
    return read_landmarks(path, **options)


@pytest.mark.parametrize(
    ("suffix", "text", "said"),
    [
        (".fcsv", FCSV, "in LPS"),
        (".fcsv", FCSV_410, "in RAS: x and y are turned"),
        (".fcsv", FCSV_3, "names no coordinate system: RAS"),
        (".mrk.json", JSON, "in RAS: x and y are turned"),
        (".json", JSON, "1 control points without a position"),
        (".pp", PP, "mm, as the landmarks' spread tells"),
        (".pp", PP, "'xiphoid' is not active"),
        (".csv", CSV, "in cm, as the file says"),
        (".csv", SLICER_CSV, "in RAS: x and y are turned"),
        (".csv", SEMICOLONS, "in m, as the file says"),
        (".csv", BARE, "names no frame: taken as the scan's, LPS"),
        (".csv", "\ufeff" + BARE.replace("\n", "\r\n"), "mm, as the landmarks' spread tells"),
    ],
)
def test_the_same_three_landmarks_come_out_of_every_format(tmp_path, suffix, text, said):
    """POINTS in LPS and m, whatever the file's unit, frame and spelling; and it is said."""
    found = read(tmp_path, suffix, text)
    assert set(found.points) == set(POINTS)
    for name, point in POINTS.items():
        np.testing.assert_allclose(found.points[name], np.array(point) / 1e3, rtol=1e-14)
    assert any(said in sentence for sentence in found.said), found.said


@pytest.mark.parametrize("suffix", [".fcsv", ".mrk.json", ".csv", ".pp"])
def test_what_is_written_is_read_again_to_the_last_digit_but_one(tmp_path, suffix):
    """m to mm and back loses at most rounding."""
    rng = np.random.default_rng(0)
    points = {name: rng.normal(0, 0.2, 3) for name in LANDMARKS}
    path = write_landmarks(tmp_path / f"l{suffix}", points)
    found = read_landmarks(path)
    assert list(found.points) == list(LANDMARKS)
    for name, point in points.items():
        np.testing.assert_allclose(found.points[name], point, rtol=1e-15)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("nipple L", "nipple_left"), ("Left nipple", "nipple_left"), ("nip_rt", "nipple_right"),
        ("NippleLeft", "nipple_left"), ("Lnipple", "nipple_left"), ("nipple-R", "nipple_right"),
        ("jugulum", "sternal_notch"), ("suprasternal notch", "sternal_notch"),
        ("Sternal Notch", "sternal_notch"), ("sternal nothc", "sternal_notch"),
        ("xyphoid", "xiphoid"), ("Xiphoid process", "xiphoid"), ("xifoid", "xiphoid"),
        ("armpit left", "axilla_left"), ("R axila", "axilla_right"),
        ("left IMF", "breast_inferior_left"), ("inframammary fold (R)", "breast_inferior_right"),
        ("medial breast l", "breast_medial_left"), ("breastLateralRight", "breast_lateral_right"),
        ("left lower breast", "breast_inferior_left"),
        *((name, name) for name in LANDMARKS),
    ],
)  # fmt: skip
def test_names_are_understood(label, name):
    assert landmark_name(label) == name


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("nipple", "name it 'nipple_left' or 'nipple_right'"),
        ("umbilicus", "no landmark is called 'umbilicus'"),
        ("left xiphoid", "the nearest are xiphoid"),
        ("left right nipple", "no landmark is called"),
        ("F-1", "no landmark is called 'F-1'; known are sternal_notch"),
        ("", "known are"),
    ],
)
def test_names_that_are_not_are_refused_with_the_nearest(label, message):
    with pytest.raises(InputError, match=message):
        landmark_name(label)


@pytest.mark.parametrize(
    ("suffix", "text", "message"),
    [
        (".csv", BARE + "nipple_left,1,2,3\n", "two landmarks 'nipple_left'"),
        (".csv", BARE.replace("480.0", "nan"), "must be at three finite numbers"),
        (".csv", BARE.replace("480.0", "high"), "is no .csv file of landmarks"),
        (".csv", "name,x,y,z\n", "holds no landmarks"),
        (".csv", "nipple_left,1,2\n", "must be at three finite numbers"),
        (".fcsv", FCSV.replace("LPS", "IJK"), "LPS or RAS, got 'IJK'"),
        (".json", '{"a": 1}', r"is no .json file of landmarks \(it holds no 'markups'"),
        (".json", "[1, 2]", r"is no .json file of landmarks \(it holds no 'markups'"),
        (".json", "{", "is no .json file of landmarks"),
        (".json", JSON.replace('"RAS"', '"XYZ"'), "export it in LPS or RAS"),
        (".pp", "<a/>", "not MeshLab's PickedPoints"),
        (".pp", '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><a>&b;</a>', "entities"),
        (".pp", PP.replace('x="95.5"', 'x=""'), "is no .pp file of landmarks"),
        (".txt", BARE, "must be one of .fcsv, .json, .pp, .csv"),
        (".csv", BARE.replace("sternal_notch", "navel"), "no landmark is called 'navel'"),
    ],
)
def test_a_wrong_file_is_refused_with_what_is_wrong(tmp_path, suffix, text, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, suffix, text)


def test_a_unit_or_a_frame_that_the_file_contradicts_is_refused(tmp_path):
    with pytest.raises(InputError, match="is in mm, got unit='cm'"):
        read(tmp_path, ".fcsv", FCSV, unit="cm")
    with pytest.raises(InputError, match="is in LPS, got frame='RAS'"):
        read(tmp_path, ".fcsv", FCSV, frame="RAS")
    found = read(tmp_path, ".pp", PP, unit="mm", frame="RAS")
    np.testing.assert_allclose(found.points["sternal_notch"], [-1.5e-3, 70.125e-3, 0.48])


# A body: an ellipse of 0.32 by 0.22 m that bulges in front, 0.5 m high.
LEVELS, TURNS = np.meshgrid(np.linspace(0, 0.5, 90), np.linspace(-np.pi, np.pi, 120, False))
X, Y, Z = 0.16 * np.cos(TURNS).ravel(), 0.11 * np.sin(TURNS).ravel(), LEVELS.ravel()


def _front(x, y, z):
    bulge = sum(np.exp(-((x - 0.08 * s) ** 2 + (z - 0.3) ** 2) / 0.04**2) for s in (-1, 1))
    return y - 0.05 * bulge * (y < 0)


def _triangles(rows, columns):
    i, j = np.meshgrid(np.arange(rows), np.arange(columns - 1), indexing="ij")
    k = (i + 1) % rows
    p, q, r, s = i * columns + j, k * columns + j, k * columns + j + 1, i * columns + j + 1
    return np.concatenate([np.stack([p, q, r], -1), np.stack([p, r, s], -1)]).reshape(-1, 3)


SCAN = Surface(np.stack([X, _front(X, Y, Z), Z], axis=1), _triangles(120, 90))


def _on(x, z):
    y = -0.11 * np.sqrt(1 - (x / 0.16) ** 2)
    return np.array([x, float(_front(x, y, z)), z])


ON_SCAN = {
    "nipple_left": _on(0.08, 0.3), "nipple_right": _on(-0.08, 0.3), "sternal_notch": _on(0, 0.46),
    "xiphoid": _on(0, 0.27),
}  # fmt: skip

AWAY = np.array([0.05, -0.2, 0.3])


@pytest.mark.parametrize("cloud", [False, True])
def test_landmarks_on_the_scan_stay_where_they_are(cloud):
    scan = Surface(SCAN.points) if cloud else SCAN
    found = check_on_scan(ON_SCAN, scan)
    assert found.said == []
    for name, point in ON_SCAN.items():
        np.testing.assert_array_equal(found.points[name], point)


@pytest.mark.parametrize("names", [list(ON_SCAN), list(ON_SCAN)[:2], list(ON_SCAN)[:3]])
@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (np.diag([-1.0, -1.0, 1.0]), "in RAS, not LPS"),
        (1e3 * np.eye(3), "in mm"),
        (1e-3 * np.eye(3), "in m"),
        (100 * np.eye(3), "in cm"),
        (1e3 * np.diag([-1.0, -1.0, 1.0]), "in RAS, not LPS (x and y turned round) and in mm"),
        (np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), "y-up with z to the front"),
    ],
)
def test_landmarks_in_another_frame_or_unit_are_brought_back_and_it_is_said(wrong, said, names):
    """The scan off the origin, as scans are: only the true reading lies on it."""
    scan = Surface(SCAN.points + AWAY, SCAN.triangles)
    given = {name: wrong @ (ON_SCAN[name] + AWAY) for name in names}
    found = check_on_scan(given, scan)
    for name in names:
        np.testing.assert_allclose(found.points[name], ON_SCAN[name] + AWAY, atol=1e-12)
    assert len(found.said) == 1
    assert said in found.said[0]


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_left_and_right_swapped_are_refused_however_the_body_lies(turn):
    """Which of names and scan is wrong, only the user knows; a scan turned by 40° too."""
    R = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    scan = Surface(SCAN.points @ R.T, SCAN.triangles)
    right = {name: R @ point for name, point in ON_SCAN.items()}
    assert check_on_scan(right, scan).said == []
    swapped = {**right, "nipple_left": right["nipple_right"], "nipple_right": right["nipple_left"]}
    with pytest.raises(InputError, match="left and right of nipple are swapped"):
        check_on_scan(swapped, scan)


def test_a_landmark_of_another_body_is_refused_and_one_over_a_hole_is_said():
    far = {**ON_SCAN, "xiphoid": ON_SCAN["xiphoid"] - [0, 0.2, 0]}
    with pytest.raises(InputError, match=r"xiphoid \(1\d\d mm\)"):
        check_on_scan(far, SCAN)
    hole = {**ON_SCAN, "xiphoid": ON_SCAN["xiphoid"] - [0, 0.03, 0]}
    found = check_on_scan(hole, SCAN)
    assert [s for s in found.said if "'xiphoid' is 3" in s and "mm from the scan" in s]


def test_plain_json_of_names_is_read(tmp_path):
    """{"name": [x, y, z]}, in the unit that it names or that the spread tells."""
    text = '{"xiphoid": [0, 0, 200], "Nipple L": [90, 0, 150], "unit": "mm", "frame": "RAS"}'
    found = read(tmp_path, ".json", text)
    np.testing.assert_allclose(found.points["nipple_left"], [-0.09, 0, 0.15], atol=1e-15)
    found = read(tmp_path, ".json", '{"xiphoid": [0, 0, 0.2], "nipple_left": [0.09, 0, 0.15]}')
    np.testing.assert_allclose(found.points["xiphoid"], [0, 0, 0.2])
    with pytest.raises(InputError, match="'xiphoid' is no list of three numbers"):
        read(tmp_path, ".json", '{"xiphoid": 3}')


def test_decimal_commas_of_a_spreadsheet_are_points(tmp_path):
    """Where semicolons divide the columns, in any order of these."""
    found = read(tmp_path, ".csv", "x_mm;y_mm;z_mm;name\n1,5;-2,25;3;xiphoid\n")
    np.testing.assert_allclose(found.points["xiphoid"], [1.5e-3, -2.25e-3, 3e-3])


def test_a_name_that_is_not_known_is_told_with_its_file(tmp_path):
    """With the names that are near, or all where none is."""
    with pytest.raises(InputError, match=r"\.csv: no landmark is called 'belly button'; known are"):
        read(tmp_path, ".csv", "name,x,y,z\nbelly button,1,2,3\n")
    with pytest.raises(InputError, match=r"\.csv: landmark .* name it 'breast_medial_left'"):
        read(tmp_path, ".csv", "name,x,y,z\nbrest_mediaal,1,2,3\n")
