"""How colours look to people with colour vision deficiencies, and how far apart they are then.

The simulation is that of G. M. Machado, M. M. Oliveira and L. A. F. Fernandes, "A Physiologically-based Model for
Simulation of Color Vision Deficiency", IEEE Trans. Visualization and Computer Graphics 15 (6), 2009, table of matrices
for a severity of 1, which apply to linear RGB. Distances are CIE 1976 colour differences in CIELAB under D65: about 2.3
is just noticeable.
"""

from __future__ import annotations

import numpy as np

NORMAL = np.eye(3)
VISIONS = {
    "normal": NORMAL,
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = TO_XYZ @ np.ones(3)


def linear(srgb: np.ndarray) -> np.ndarray:
    """Linear RGB of sRGB, both (..., 3) from 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def encoded(rgb: np.ndarray) -> np.ndarray:
    """The inverse of :func:`linear`."""
    return np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * np.maximum(rgb, 0.0) ** (1.0 / 2.4) - 0.055)


def seen(srgb: np.ndarray, vision: str) -> np.ndarray:
    """How sRGB colours (..., 3) from 0 to 1 look with a kind of vision, a key of ``VISIONS``."""
    return encoded(np.clip(linear(srgb) @ VISIONS[vision].T, 0.0, 1.0))


def lab(srgb: np.ndarray) -> np.ndarray:
    """CIELAB (..., 3) of sRGB (..., 3) from 0 to 1."""
    ratios = linear(srgb) @ TO_XYZ.T / WHITE
    f = np.where(ratios > (6.0 / 29.0) ** 3, np.cbrt(ratios), ratios / (3.0 * (6.0 / 29.0) ** 2) + 4.0 / 29.0)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def differences(srgb: np.ndarray, vision: str) -> np.ndarray:
    """The colour difference of every two of n colours (n, 3), as seen: (n, n)."""
    places = lab(seen(srgb, vision))
    return np.linalg.norm(places[:, None] - places, axis=2)
