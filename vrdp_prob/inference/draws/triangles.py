"""Triangular roots of matrices that are known by a root of them; unlike Cholesky factors they exist after rounding."""

import numpy as np
from jaxtyping import Float
from scipy.linalg import qr


def upper_root(rows: Float[np.ndarray, "row number"]) -> Float[np.ndarray, "number number"]:
    """Upper triangle whose product with itself, `R.T @ R`, is that of some rows."""
    missing = max(rows.shape[1] - len(rows), 0)
    padded = np.pad(rows, ((0, missing), (0, 0)))
    triangle: np.ndarray = qr(padded, mode="r", check_finite=False)[0][: rows.shape[1]] if rows.size else padded
    return triangle


def lower_root(root: Float[np.ndarray, "number column"]) -> Float[np.ndarray, "number number"]:
    """Cholesky factor of `root @ root.T`."""
    triangle = upper_root(root.T).T
    lower: np.ndarray = triangle * np.where(np.diag(triangle) < 0, -1.0, 1.0)
    return lower
