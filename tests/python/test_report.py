"""The report: offline, escaped, and with the numbers of the result."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from supple.breast.report import ReportData, write_report
from supple.breast.report_figures import _cut
from supple.breast.result import Check, MeshFigures, Parameter, Result, Tumour
from supple.errors import InputError
from supple.page import thinned

EVIL = '<img src=x onerror=alert(1)> & "patient\'s" </script>'
DEPTH = {"prone": 0.075, "rest": 0.055, "supine": 0.035}
SPREAD = {"prone": 0.062, "rest": 0.068, "supine": 0.078}


def dome(height: float, radius: float, x: Any, z: Any, aside: float = 0.0) -> Any:
    """Front of an elliptic torso with two half-ellipsoids: y (m) at x, z."""
    y = -0.105 * np.sqrt(np.clip(1 - (x / 0.165) ** 2, 0, None))
    for side in (-1, 1):
        rho = ((x - side * (0.08 + aside)) ** 2 + z**2) / radius**2
        y = y - height * np.clip(1 - rho, 0, None) ** 0.6
    return y


def grid(count: int) -> tuple[Any, Any, Any]:
    theta, z = np.meshgrid(np.linspace(-1.35, 1.35, count), np.linspace(-0.13, 0.13, count))
    index = np.arange(theta.size).reshape(theta.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    tri = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return 0.165 * np.sin(theta), z, tri


def report_data(count: int = 60, **changes: Any) -> ReportData:
    """Skin, chest (a static copy 12 mm deeper), a gland in each breast, a tumour that moves."""
    x, z, tri = grid(count)
    points, centre, nipple = {}, {}, {}
    tumours = {"prone": (0.075, -0.135, 0.02), "rest": (0.085, -0.115, 0.024)}
    tumours["supine"] = (0.100, -0.095, 0.03)
    for pose, height in DEPTH.items():
        aside = {"prone": 0.0, "rest": 0.006, "supine": 0.016}[pose]
        y = dome(height, SPREAD[pose], x, z, aside)
        skin = np.stack([x, y, z], -1).reshape(-1, 3)
        chest = np.stack([0.93 * x, dome(0, 1, x, z) + 0.012, z], -1).reshape(-1, 3)
        gland = 0.75 * skin + 0.25 * chest
        points[pose] = np.concatenate([skin, chest, gland])
        centre[pose] = np.array(tumours[pose])
        nipple[pose] = np.array(
            [0.08 + aside, dome(height, SPREAD[pose], 0.08 + aside, 0, aside), 0]
        )
    raised = np.linalg.norm(
        points["prone"][: x.size] - points["prone"][x.size : 2 * x.size], axis=1
    )
    gland_tri = tri[(raised[tri] > 0.03).all(axis=1)] + 2 * x.size
    tumour = Tumour.locate(
        centre["prone"], centre["supine"], nipple["supine"], (points["supine"], tri)
    )
    checks = {"cells keep their sense (J > 0)": Check(True, 0.61)}
    checks["mesh volume against segmentation"] = Check(True, "0.4 % (limit 3 %)")
    checks["round trip prone, rest, prone"] = Check(True, "3e-13 m")
    parameters = {"breast.young": Parameter(1012.0, "Pa", 35.0)}
    parameters |= {"skin.young": Parameter(22720.0, "Pa"), "breast.poisson": Parameter(0.45, "1")}
    result = Result(
        tumour,
        parameters,
        MeshFigures(12345, 67890, 0.31, 734.0),
        {"segment": 3.1, "rest shape": 8.2, "supine": 4.0, "total": 16.4},
        checks,
        {"supple": "0.1.0", "plotly": "7.1"},
        ["Nipple estimated as the foremost point of the breast.", EVIL],
        skin_mae_mm=1.4,
    )
    scan = points["supine"][: x.size : 2] + np.random.default_rng(0).normal(0, 1e-3, (1, 3))
    given = {
        "result": result, "points": points, "skin": tri, "tumour": centre, "tumour_radius": 0.007,
        "nipple": nipple, "gland": gland_tri, "chest": tri + x.size, "scan": scan, "title": EVIL,
        "assumptions": {"pose of the image": "prone", "density": "1,000 kg/m³", EVIL: EVIL},
        **changes,
    }  # fmt: skip
    return ReportData(**given)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(path, report_data())
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]
    return path.read_text(encoding="utf-8")


def own(page: str) -> str:
    """The page without plotly's code."""
    return re.sub(r'<script id="plotly">.*?</script>', "", page, flags=re.S)


def test_the_page_asks_the_network_for_nothing(page: str) -> None:
    text = own(page)
    assert len(text) < len(page) - 1_000_000, "plotly must be inside the file"
    assert not re.search(r"https?:|//[a-z]+\.|@import|url\(|fetch\(|XMLHttp|<link|<iframe", text)
    assert not re.search(r"<(script|img)[^>]+src\s*=\s*[\"']?(?!data:)[^x\s]", text)
    assert "default-src 'none'" in text
    assert "connect-src 'none'" in text


def test_every_text_of_the_user_is_escaped(page: str) -> None:
    assert EVIL not in page
    assert "<img" not in page.split('<script id="plotly">')[0]
    assert page.count("&lt;img src=x onerror=alert(1)&gt; &amp;") >= 4


def test_the_first_screen_says_where_the_tumour_is(page: str) -> None:
    tumour = report_data().result.tumour
    first = page.split('class="view"')[0]
    assert f"{tumour.depth_mm:.0f}<small>mm" in first
    assert f"{tumour.clock} o&#x27;clock" in first
    assert f"{tumour.nipple_distance_mm:.0f}<small>mm" in first
    assert "left breast" in first
    # (25, 40, 10) mm from prone to supine: 48 mm long
    assert "48<small>mm" in first
    assert "40 mm to the back (posterior), 25 mm to the left, 10 mm to the head" in first
    assert "Research use only. Not for diagnosis or treatment." in first


def test_the_tables_hold_parameters_checks_and_versions(page: str) -> None:
    for text in ("1012 Pa ± 35 (sd)", "22720 Pa (given, not measured)", "0.4 % (limit 3 %)"):
        assert text in page
    for text in ("12,345 nodes", "734 ml", "16.4 s", "1.4 mm mean distance", "L&nbsp;100.0"):
        assert text in page


def test_a_failed_check_is_on_the_first_screen(tmp_path: Path) -> None:
    good = report_data().result
    bad = Result(**{**vars(good), "checks": {"J > 0": Check(False, -0.2)}})
    write_report(tmp_path / "x.html", report_data(result=bad))
    first = (tmp_path / "x.html").read_text(encoding="utf-8").split('class="view"')[0]
    assert "Do not rely on this result" in first
    assert "J &gt; 0" in first


def test_the_scene_holds_the_surfaces_in_mm(page: str) -> None:
    data = report_data()
    match = re.search(r'id="data">(.*?)</script>', page, flags=re.S)
    assert match
    scene = json.loads(match[1])
    n = 60 * 60
    for pose in ("prone", "rest", "supine"):
        packed = np.frombuffer(base64.b64decode(scene["skin"][pose]), "<f4").reshape(-1, 3)
        assert np.allclose(packed, 1e3 * np.asarray(data.points[pose])[:n], atol=1e-4)
    moved = np.asarray(data.points["supine"])[:n] - np.asarray(data.points["prone"])[:n]
    colour = np.frombuffer(base64.b64decode(scene["skin"]["colour"]), "<f4")
    assert np.allclose(colour, 1e3 * np.linalg.norm(moved, axis=1), atol=1e-4)


def test_a_fine_mesh_still_gives_a_file_under_8_mb(tmp_path: Path) -> None:
    """270,000 nodes are thinned for display; the file stays under 8 MB."""
    write_report(tmp_path / "x.html", report_data(count=300))
    assert (tmp_path / "x.html").stat().st_size < 8e6


@pytest.mark.parametrize("most", [10, 300, 5000])
def test_a_surface_is_thinned_to_nodes_of_its_own_that_cover_it(most: int) -> None:
    """A square of 100 mm, a node each 2 mm: at most ``most`` are left, none far from the others."""
    x, y = (g.ravel() for g in np.meshgrid(*[np.arange(0.0, 101.0, 2.0)] * 2))
    points = np.stack([x - 700, y, 0 * x], axis=1)
    corner = np.arange(51 * 51).reshape(51, 51)
    p, q, r, s = (corner[i : 50 + i, j : 50 + j].ravel() for i in (0, 1) for j in (0, 1))
    triangles = np.vstack([np.stack(t, axis=1) for t in ((p, q, s), (p, s, r))])
    kept, faces = thinned(points, triangles, most)
    assert 0.2 * most < len(kept) <= most or len(kept) == len(points)
    assert faces.max(initial=0) < len(kept)
    gap = np.linalg.norm(points[:, None] - points[kept][None], axis=2).min(axis=1).max()
    assert gap < 2 * 100 / len(kept) ** 0.5 * 1.5
    assert len(thinned(points[:0], triangles[:0], most)[0]) == 0


def test_a_plane_cuts_a_tetrahedron_in_a_triangle_of_known_sides() -> None:
    """x + y + z <= 1 cut at z = 1/4: a right triangle with legs 3/4."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    lines = _cut(points, faces, 2, 0.25)
    lengths = sorted(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))
    assert np.allclose(lengths, [0.75, 0.75, 0.75 * np.sqrt(2)])


def test_parts_that_are_not_there_are_left_out(tmp_path: Path) -> None:
    write_report(tmp_path / "x.html", report_data(gland=None, chest=None, scan=None))
    text = own((tmp_path / "x.html").read_text(encoding="utf-8"))
    assert text.count("<label hidden>") == 3


def test_bad_arrays_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    data = report_data()
    points = {k: v for k, v in data.points.items() if k != "rest"}
    tumour = {**data.tumour, "supine": [np.nan, 0, 0]}
    with pytest.raises(InputError, match="no rest"):
        write_report(tmp_path / "x.html", report_data(points=points))
    with pytest.raises(InputError, match="skin must name one of"):
        write_report(tmp_path / "x.html", report_data(skin=[[0, 1, 10**6]]))
    with pytest.raises(InputError, match="NaN in supine"):
        write_report(tmp_path / "x.html", report_data(tumour=tumour))
    assert list(tmp_path.iterdir()) == []
