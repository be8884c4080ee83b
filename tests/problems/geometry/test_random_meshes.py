"""Files of known bodies, stated in random legal ways: what is read is what they are, and what Assimp reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.random_meshes import WRITERS, bodies

from problems.geometry import read_mesh, read_parts

MANY = 200
PLACES = 2e-6  # m, m^2, m^3: files are in single precision
SINGLE = 1e-5  # the same, of chains of transformations in single precision
SEEDS = [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, MANY))]


def measured(triangles: np.ndarray) -> np.ndarray:
    """Area, volume, moments of the area, and corners of the box around triangles (n, 3, 3): (11,)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2.0
    volume = float(np.linalg.det(triangles).sum()) / 6.0
    ends = [triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))]
    return np.concatenate([[areas.sum(), volume], areas @ triangles.mean(axis=1), *ends])


def read_by_assimp(path: Path) -> np.ndarray:
    """The triangles of a file, (n, 3, 3), in m, with z up."""
    assimp = pytest.importorskip("assimp_py", reason="assimp-py, of the extra 'oracles', is not installed")
    scene = assimp.import_file(str(path), assimp.Process_Triangulate | assimp.Process_PreTransformVertices)
    meshes = [np.array(mesh.vertices, dtype=float).reshape(-1, 3)[np.array(mesh.indices)] for mesh in scene.meshes]
    triangles = np.concatenate(meshes).reshape(-1, 3, 3)
    return triangles[..., [0, 2, 1]] * [1.0, -1.0, 1.0] if path.suffix == ".dae" else triangles  # it turns z to y


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", WRITERS)
def test_a_legal_file_is_read_as_what_it_states(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    parts = bodies(rng)
    content = WRITERS[kind](rng, parts, False)
    truth = measured(np.concatenate([body.triangles for body in parts]))
    np.testing.assert_allclose(measured(read_mesh(f"a.{kind}", content).corners), truth, atol=PLACES)
    shown = np.concatenate([part.corners for part in read_parts(f"a.{kind}", content)])
    np.testing.assert_allclose(measured(shown), truth, atol=PLACES)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", WRITERS)
def test_a_legal_file_is_read_as_assimp_reads_it(kind: str, seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng([seed, 6])
    path = tmp_path / f"body.{kind}"
    path.write_bytes(WRITERS[kind](rng, bodies(rng), True))
    own, assimp = read_mesh(path.name, path.read_bytes()).corners, read_by_assimp(path)
    np.testing.assert_allclose(measured(own), measured(assimp), atol=SINGLE)
