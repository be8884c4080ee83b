"""Mesh files element by element: polygons of every form, what each format may state, and what is refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from helpers.random_meshes import WRITERS, bodies, numbers

from problems.base import InvalidProblem
from problems.geometry import read_mesh, read_parts
from problems.geometry.mesh_files.faces import MOST_CUT

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def area(name: str, text: str | bytes) -> float:
    return area_of(read_mesh(name, text if isinstance(text, bytes) else text.encode()).corners)


def area_of(corners: np.ndarray) -> float:
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(doubled, axis=1).sum() / 2.0)


def refusal(name: str, text: str | bytes) -> str:
    with pytest.raises(InvalidProblem) as error:
        read_mesh(name, text if isinstance(text, bytes) else text.encode())
    assert "\n" not in str(error.value)
    assert error.value.field == "mesh"
    return error.value.reason


# Polygons


def polygon(places: np.ndarray) -> str:
    lines = [f"v {numbers(place)}" for place in places]
    return "\n".join([*lines, f"f {' '.join(str(i + 1) for i in range(len(places)))}"])


def ring(*corners: tuple[float, float]) -> np.ndarray:
    """Corners in a plane that is not along the axes."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return np.column_stack([corners, np.zeros(len(corners))]) @ turn.T


U_SHAPE = ((0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3))  # 7 m^2
WITH_A_HOLE = ((0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1))  # 8 m^2, by a bridge


@pytest.mark.parametrize(("corners", "square_metres"), [(U_SHAPE, 7.0), (WITH_A_HOLE, 8.0)])
@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("start", range(8))
def test_what_is_plane_is_cut_exactly(
    corners: tuple[tuple[float, float], ...], square_metres: float, mirror: int, start: int
) -> None:
    turned = np.roll(ring(*corners), start, axis=0)[::mirror]
    assert area("a.obj", polygon(turned)) == pytest.approx(square_metres)
    assert len(read_mesh("a.obj", polygon(turned).encode()).corners) == len(corners) - 2


def test_what_crosses_itself_is_held() -> None:
    """Of a bow tie both wings, of a star all points; more may be held, never less."""
    points = np.exp(2j * np.pi * np.arange(5) * 2 / 5)
    star = ring(*zip(points.real, points.imag, strict=True))
    for places in (ring((0, 0), (1, 1), (1, 0), (0, 1)), star):
        corners = read_mesh("a.obj", polygon(places).encode()).corners
        for one, two in zip(places, np.roll(places, -1, axis=0), strict=True):
            assert touched(corners, 0.45 * one + 0.45 * two + 0.1 * places.mean(axis=0))


def touched(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point is in a triangle."""
    sides = np.stack([*(corners[:, 1:] - corners[:, :1]).swapaxes(0, 1)], axis=-1)
    shares = np.stack(
        [np.linalg.lstsq(side, point - first, rcond=None)[0] for side, first in zip(sides, corners[:, 0], strict=True)]
    )
    near = np.linalg.norm(np.einsum("nij,nj->ni", sides, shares) + corners[:, 0] - point, axis=1) < 1e-9
    return bool((near & (shares >= -1e-9).all(axis=1) & (shares.sum(axis=1) <= 1.0 + 1e-9)).any())


@pytest.mark.parametrize("count", [4, 5, 8])
def test_out_of_plane_all_triangles_of_three_corners_are_taken(count: int) -> None:
    """By one diagonal of a quadrilateral, what lies along the other would be lost."""
    turn = 2.0 * np.pi * np.arange(count) / count
    places = np.column_stack([np.cos(turn), np.sin(turn), 0.1 * (-1.0) ** np.arange(count)])
    mesh = read_mesh("a.obj", polygon(places).encode())
    assert len(mesh.corners) == count * (count - 1) * (count - 2) // 6
    assert all(touched(mesh.corners, (one + two) / 2.0) for one in places for two in places)
    (part,) = read_parts("a.obj", polygon(places).encode())
    assert (len(part.corners), len(part.further)) == (count - 2, len(mesh.corners) - count + 2)


def test_of_many_corners_only_rounding_is_out_of_plane() -> None:
    turn = 2.0 * np.pi * np.arange(30) / 30
    plane = np.column_stack([np.cos(turn), np.sin(turn), 0.00009 * (-1.0) ** np.arange(30)])
    assert area("a.obj", polygon(plane)) == pytest.approx(15.0 * np.sin(np.pi / 15.0), rel=1e-3)
    reason = refusal("a.obj", polygon(plane * [1.0, 1.0, 2.0]))
    assert reason == "line 31: its 30 corners lie in no plane: export it in triangles"


def test_single_precision_is_no_flaw() -> None:
    places = (ring((0, 0), (0.001, 0), (0.001, 0.001), (0, 0.001)) + 0.7).astype(np.float32)
    assert len(read_mesh("a.obj", polygon(places).encode()).corners) == 2


def test_a_huge_concave_polygon_is_held_by_a_fan() -> None:
    turn = 2.0 * np.pi * np.arange(MOST_CUT + 2) / (MOST_CUT + 2)
    radius = np.where(np.arange(MOST_CUT + 2) % 2, 0.5, 1.0)
    places = ring(*zip(radius * np.cos(turn), radius * np.sin(turn), strict=True))
    assert len(read_mesh("a.obj", polygon(places).encode()).corners) == MOST_CUT
    assert area("a.obj", polygon(places)) > MOST_CUT / 4.0 * np.sin(turn[1])


# OBJ


@pytest.mark.parametrize(
    "text",
    [
        "  f 1 2 3 4\n" + SQUARE,
        "\ufeff" + SQUARE.replace("\n", "\r\n") + "f 1/1 2/2/2 3//3 4/ # four\r\n",
        SQUARE.replace("\n", "\r") + "f 1 2 3 4",
        SQUARE.replace("v 1 1 0", "v 1 \\\n 1\\\n 0") + "f \\\r\n1 2 \\\n3 4",
        SQUARE.replace("\nv", " 0.5 1 0\nv") + "f 1 2 3\nf 1 3 4",
        SQUARE.replace("\n", " 1.0\n") + "f 1 2 3 4",
        f"# a folder: C:\\\n{SQUARE}o f\ng 1 2 3\ns off\nusemtl a b\nvt 0 0\nvn 0 0 1\nvp 0 0\nf 1 2 3 4\nlod 1",
    ],
)
def test_obj_states_a_square_in_many_ways(text: str) -> None:
    assert area("a.obj", text) == pytest.approx(1.0)


def test_lines_and_points_are_left_out_and_that_is_said() -> None:
    mesh = read_mesh("a.obj", f"{SQUARE}f 1 2 3 4\nl 1 2\np 3".encode())
    assert mesh.reading == ("has lines or points, which have no surface and are left out",)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (SQUARE + "f 1 2 3 5", "line 5: a corner is none of the 4 vertices"),
        (SQUARE + "f 1 2 0", "line 5: '0' is no corner of f"),
        (SQUARE + "f 1 2 3/4/5/6", "line 5: '3/4/5/6' is no corner of f"),
        (SQUARE + "f 1 2", "line 5: f needs three corners"),
        (SQUARE + "F 1 2 3", "line 5: the element 'F' is not read"),
        (SQUARE + "f 1 2 3\nsurf 0 1 0 1 1 2 3", "line 6: the element 'surf' is not read"),
        ("v 1 2\n", "line 1: v needs three numbers, and may have a weight of 1 or a colour"),
        ("v 1_0 2 3\n", "line 1: v needs three numbers, and may have a weight of 1 or a colour"),
        ("v 1 2 3 0.5\n", "line 1: v needs three numbers, and may have a weight of 1 or a colour"),
        (SQUARE + "f 1 2\\\n3 4", "line 5: its last word may end at the backslash, or go on after it"),
        (SQUARE + "f 1 2 \\ \n3 4", "line 5: '\\\\' is no corner of f"),
        (SQUARE + "g a \\\n f 1 2 3", "line 5: 'g' goes on after a backslash, which is not read"),
        (SQUARE + "f 1 2 3 \\", "line 5: the file ends after a backslash"),
        (SQUARE.encode("utf-16"), "line 1: the element "),
    ],
)
def test_obj_names_the_line_that_it_does_not_read(text: str | bytes, reason: str) -> None:
    assert refusal("a.obj", text).startswith(reason)


# STL


def text_stl(name: str = "", facets: int = 1) -> str:
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    return f"solid{name}\n{facets * facet}endsolid{name}\n"


def binary_stl(head: bytes = b"", facets: int = 1, counted: int | None = None, more: bytes = b"") -> bytes:
    facet = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return head.ljust(80, b"\0") + struct.pack("<I", facets if counted is None else counted) + facets * facet + more


@pytest.mark.parametrize(
    ("content", "facets"),
    [
        (text_stl(" vertex 9 9 9", 2).encode(), 2),
        (text_stl(" endloop of a solid").upper().encode(), 1),
        (text_stl(" empty", 0).encode() + text_stl().encode(), 1),
        (text_stl().replace("endsolid", " endsolid of another name").encode(), 1),
        (text_stl().replace("vertex 1 0 0", "vertex 1.0D+00 0.D0 0e0").encode(), 1),
        (text_stl().replace("0 0 1", "nan -nan(ind) nan").encode(), 1),
        (text_stl().replace("\nouter", " outer").replace("\nvertex", "\tvertex").encode(), 1),
        (binary_stl(b"solid vertex 1 2 3", 3), 3),
        (binary_stl(b"solid\nfacet normal", 2), 2),
    ],
)
def test_stl_is_read_whole(content: bytes, facets: int) -> None:
    corners = read_mesh("a.stl", content).corners
    assert len(corners) == facets
    assert area_of(corners) == pytest.approx(0.5 * facets)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (binary_stl(counted=2), "its head counts 2 facets, 184 bytes; it has 134"),
        (binary_stl(more=b"\0"), "its head counts 1 facets, 134 bytes; it has 135"),
        (binary_stl(b"solid a", counted=3), "its head counts 3 facets, 234 bytes; it has 134"),
        (binary_stl()[:60], "it begins neither with 'solid' nor with the head of a binary file"),
        (b"facet normal 0 0 1", "it begins neither with 'solid' nor with the head of a binary file"),
        (text_stl()[:40].encode(), "the solid in line 1 does not end: the file is cut off"),
        (text_stl().encode() + b"solid\n", "the solid in line 10 does not end: the file is cut off"),
        (text_stl().replace("endsolid", "solid").encode(), "line 9: a solid begins in another"),
        (text_stl().encode() + b"facet", "line 10: it is in no solid"),
        (b"solid facet normal 0 0 1\nendsolid", "line 1: a facet stands in the line of its solid"),
        (text_stl().replace("endloop", "vertex 1 1 0\nendloop").encode(), "the solid in line 1: its facet 1 is not"),
        (text_stl("", 3).replace("endfacet", "", 1).encode(), "the solid in line 1: its facet 1 is not read"),
        (text_stl().replace("vertex 1 0 0", "vertex 1 0 1_0").encode(), "the solid in line 1: a coordinate is no n"),
        (text_stl().replace("vertex 1 0 0", "vertex 1 0 0 0").encode(), "the solid in line 1: its facet 1 is not"),
        (text_stl().replace("vertex 1", "vertex " + 50 * "1").encode(), "the solid in line 1: a word of more than 40"),
    ],
)
def test_stl_is_refused_where_it_is_not_whole(content: bytes, reason: str) -> None:
    assert refusal("a.stl", content).startswith(reason)


# DAE


def dae(  # a square of 1 m in two triangles, unless other is stated
    primitives: str | None = None,
    transforms: str = "",
    instance: str = '<instance_geometry url="#g"/>',
    asset: str = "<up_axis>Z_UP</up_axis>",
    more: str = "",
    node: str = "",
) -> str:
    primitives = dae_primitive("triangles", 2, "<p>0 1 2 0 2 3</p>") if primitives is None else primitives
    return f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>
<library_geometries><geometry id="g" name="square"><mesh><source id="p"><float_array id="a" count="12">
0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common><accessor source="#a" count="4" stride="3">
<param name="X"/><param name="Y"/><param name="Z"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitives}</mesh></geometry>
</library_geometries>{more}
<library_visual_scenes><visual_scene id="s"><node id="n">{transforms}{instance}{node}</node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def dae_primitive(kind: str, count: int, lists: str, more: str = "") -> str:
    return (
        f'<{kind} count="{count}" material="m"><input semantic="VERTEX" source="#v" offset="0"/>{more}{lists}</{kind}>'
    )


HALF = dae_primitive("triangles", 1, "<p>0 1 2</p>")
FILLED = """<library_effects><effect id="e"><profile_COMMON><technique sid="c"><phong><diffuse>{}</diffuse></phong>
</technique></profile_COMMON></effect></library_effects>
<library_materials><material id="x"><instance_effect url="#e"/></material></library_materials>"""
BOUND = """<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="m" target="#x"/>
</technique_common></bind_material></instance_geometry>"""


@pytest.mark.parametrize(
    ("primitives", "square_metres"),
    [
        (dae_primitive("trifans", 2, "<p>0 1 2 3</p><p>0 1 2</p>"), 1.5),
        (dae_primitive("triangles", 1, "<p>0 1 2</p>") + dae_primitive("trifans", 1, "<p>0 2 3</p>"), 1.0),
        (dae_primitive("triangles", 0, "") + HALF, 0.5),
        (HALF + dae_primitive("lines", 1, "<p>0 1</p>"), 0.5),
        (HALF.replace("<p>0 1 2", '<input semantic="NORMAL" source="#p" offset="2"/><p>0 9 9 1 9 9 2 9 9'), 0.5),
    ],
)
def test_dae_reads_every_primitive_with_a_surface(primitives: str | None, square_metres: float) -> None:
    mesh = read_mesh("a.dae", dae(primitives).encode())
    assert area_of(mesh.corners) == pytest.approx(square_metres)
    assert bool(mesh.reading) == ("<lines" in (primitives or ""))


def test_dae_places_a_geometry_as_often_as_its_scene_says() -> None:
    """In the node, in one inside it that moves it by 2 m, and through a node of a library in both."""
    inner = '<node><translate>2 0 0</translate><instance_geometry url="#g"/><instance_node url="#k"/></node>'
    library = (
        '<library_nodes><node id="k"><translate>0 0 1</translate><instance_geometry url="#g"/></node></library_nodes>'
    )
    text = dae(instance='<instance_geometry url="#g"/><instance_node url="#k"/>', node=inner, more=library)
    corners = read_mesh("a.dae", text.encode()).corners
    lowest = {tuple(triangle.min(axis=0).tolist()) for triangle in corners}
    assert lowest == {(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (2.0, 0.0, 0.0), (2.0, 0.0, 1.0)}
    assert len(corners) == 8


def test_dae_is_converted_from_its_unit_and_not_turned() -> None:
    asset = '<unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis>'
    mesh = read_mesh("a.dae", dae(asset=asset, transforms="<translate>1 0 0</translate>").encode(), (2.0, 1.0, 1.0))
    np.testing.assert_allclose(mesh.corners.max(axis=(0, 1)), (4 * 0.0254, 0.0254, 0.0))
    assert (mesh.up, mesh.reading) == ("Y", ("is in a unit of 0.0254 m, as it says: its lengths are converted",))


def test_a_geometry_that_is_placed_nowhere_is_left_out_and_that_is_said() -> None:
    more = '<library_geometries><geometry id="other"><mesh/></geometry></library_geometries>'
    (note,) = read_mesh("a.dae", dae(more=more).encode()).reading
    assert note == 'has geometries that its scene places nowhere and that are left out, <geometry id="other"> first'


@pytest.mark.parametrize(
    ("diffuse", "instance", "colour"),
    [
        ("<color>1 0.5 0 1</color>", BOUND, "#ff8000"),
        ('<texture texture="t" texcoord="u"/>', BOUND, "#ffffff"),
        ("<color>red</color>", BOUND, "#ffffff"),
        ("<color>1 0.5 0 1</color>", '<instance_geometry url="#g"/>', ""),
    ],
)
def test_the_colour_of_a_dae_is_that_of_its_material(diffuse: str, instance: str, colour: str) -> None:
    (part,) = read_parts("a.dae", dae(instance=instance, more=FILLED.format(diffuse)).encode(), (2.0, 1.0, 1.0))
    assert (part.colour, area_of(part.corners)) == (colour, pytest.approx(2.0))


def deep(count: int) -> str:
    return f"{'<node>' * count}<instance_geometry url='#g'/>{'</node>' * count}"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (dae(transforms="<lookat>0 0 0 1 0 0 0 0 1</lookat>"), '<instance_geometry url="#g">: <lookat> above it is n'),
        (dae(instance='<instance_controller url="#c"/>'), '<node id="n">: <instance_controller url="#c"> is not read'),
        (dae(instance='<instance_geometry url="o.dae#g"/>'), '<instance_geometry url="o.dae#g">: url=\'o.dae'),
        (dae(instance='<instance_geometry url="#h"/>'), "<instance_geometry url=\"#h\">: no <geometry> has the id 'h'"),
        (dae(more='<geometry id="g"/>'), "<instance_geometry url=\"#g\">: more than one <geometry> has the id 'g'"),
        (dae(instance='<instance_node url="#n"/>'), '<node id="n">: more than 20000 nodes, or 100 in each other'),
        (dae(instance=deep(100)), "<node>: more than 20000 nodes, or 100 in each other"),
        (dae(transforms="<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1</matrix>"), "<matrix>: its last row is not 0 0 0 1"),
        (dae(transforms="<rotate>0 0 0 9</rotate>"), "<rotate>: its axis has no length, or its angle is none"),
        (dae(transforms="<scale>1 1</scale>"), "<scale>: 3 numbers are needed, not 2"),
        (dae(transforms="<scale>nan 1 1</scale>"), "a coordinate is no finite number"),
        (dae(asset='<unit meter="0"/>'), "<asset>: the unit '0' or the axis 'Y_UP' is none"),
        (dae(transforms='<asset><unit meter="2"/></asset>'), "<asset>: parts of it state another unit or another axis"),
        (dae().replace('<instance_visual_scene url="#s"/>', ""), "<scene>: one <instance_visual_scene> is needed"),
        (dae().replace("</scene>", "<instance_physics_scene/></scene>"), "<scene>: <instance_physics_scene> is not"),
        (dae().replace("mesh>", "convex_mesh>"), '<geometry id="g">: <convex_mesh> is not read'),
        (dae("<patches/>"), "<mesh>: <patches> is not read"),
        (dae(dae_primitive("polygons", 1, "<ph><p>0 1 2 3</p><h>0 1 2</h></ph>")), "<polygons>: <ph> is not read"),
        (dae(dae_primitive("triangles", 2, "<p>0 1 2</p>")), "<triangles>: it counts 2, but has 1"),
        (dae(dae_primitive("triangles", 1, "<p>0 1 2 3</p>")), "<triangles>: its corners are not those of whole pol"),
        (dae(dae_primitive("triangles", 1, "<p>0 1 4</p>")), '<geometry id="g">: polygon 0: a corner is none of the'),
        (dae(dae_primitive("triangles", 1, "<p>0 1 2.</p>")), "<p>: invalid literal for int() with base 10: '2.'"),
        (dae(dae_primitive("triangles", 1, "<p>0 1 2<p/></p>")), "<p>: there is more in it than numbers"),
        (dae(dae_primitive("polylist", 1, "<p>0 1 2</p>")), "<polylist>: it counts 1, but has 0"),
        (dae(dae_primitive("polylist", 1, "<vcount>2</vcount><p>0 1</p>")), "<polylist>: its corners are not those of"),
        (dae(dae_primitive("tristrips", 1, "<p>0 1</p>")), "<tristrips>: three corners are needed"),
        (dae(HALF.replace("VERTEX", "NORMAL")), "<triangles>: one input VERTEX is needed, not 0"),
        (dae(HALF.replace("<p>", '<input semantic="NORMAL" source="#p" offset="1"/><p>')), "<triangles>: 3 indices"),
        (dae(HALF.replace('offset="0"', "")), "<input>: offset='' is no whole number"),
        (dae(HALF.replace("<p>", "<p>99999999999999999999 ")), "<p>: a number in it is too large"),
        (dae().replace('count="12"', 'count="15"'), '<float_array id="a">: 15 numbers are needed, not 12'),
        (dae().replace('"4" stride', '"5" stride'), '<source id="p">: 12 numbers, too few for 5 places'),
        (dae().replace('name="Z"', ""), '<source id="p">: its parameters are not X, Y, Z'),
        (dae().replace("</COLLADA>", ""), "it cannot be read: no XML: no element found"),
    ],
)
def test_dae_names_the_element_that_it_does_not_read(text: str, reason: str) -> None:
    assert refusal("a.dae", text).startswith(reason)


def test_nodes_that_multiply_end_soon() -> None:
    """Each places the next ten times: a thousand million squares."""
    names = "abcdefghi"
    nodes = "".join(
        f'<node id="{one}">{10 * f"<instance_node url={chr(34)}#{two}{chr(34)}/>"}</node>'
        for one, two in zip(names, [*names[1:], "j"], strict=True)
    )
    library = f'<library_nodes>{nodes}<node id="j"><instance_geometry url="#g"/></node></library_nodes>'
    reason = refusal("a.dae", dae(instance='<instance_node url="#a"/>', more=library))
    assert "more than 20000 nodes" in reason


def test_a_lookat_above_a_camera_is_no_matter() -> None:
    camera = '<node><lookat>0 0 0 1 0 0 0 0 1</lookat><instance_camera url="#c"/></node>'
    assert area("a.dae", dae(node=camera)) == pytest.approx(1.0)


# All


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("seed", range(3))
def test_a_damaged_file_is_read_or_refused_in_one_line(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 7])
    content = WRITERS[kind](rng, bodies(rng)[:1], False)
    for _ in range(60):
        places = rng.integers(0, len(content), 2)
        damage = [b"", b" ", b"\n", b"-", b"0", b"\\", b"<", b"\0", b"nan", b"999999", content[slice(*sorted(places))]]
        damaged = content[: places[0]] + damage[rng.integers(len(damage))] + content[places[0] + rng.integers(3) :]
        try:
            read_mesh(f"a.{kind}", damaged)
        except InvalidProblem as error:
            assert "\n" not in str(error) and len(str(error)) < 300


def test_a_quad_far_from_the_origin_is_no_flatter() -> None:
    """Both ways to cut it are held, as near the origin: only rounding is forgiven, and no more of it than a little."""
    far = "\n".join(f"v {5e6 + x} {y} {z}" for x, y, z in ((0, 0, 0), (1, 0, 0.5), (1, 1, 0), (0, 1, 0.5)))
    assert len(read_mesh("a.obj", f"{far}\nf 1 2 3 4\n".encode()).corners) == 4
