"""sRGB's transfer curve (IEC 61966-2-1), between bytes and linear light."""

import numpy as np

__all__ = ["decode", "encode"]


def encode(linear):
    """Encoded value in 0…1 of linear light, which is clipped to 0…1."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def decode(levels):
    """Linear light in 0…1 of bytes 0…255."""
    encoded = np.asarray(levels) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
