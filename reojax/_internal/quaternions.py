"""The algebra of quaternions (w, x, y, z), component by component: numbers, NumPy or JAX arrays of any one shape."""

from typing import Any


def product(p: Any, q: Any) -> tuple[Any, Any, Any, Any]:
    """Quaternion of the rotation `P Q`: in the frame that P made, do Q."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def inverse(q: Any) -> tuple[Any, Any, Any, Any]:
    """Quaternion of the inverse rotation, of a unit quaternion."""
    w, x, y, z = q
    return w, -x, -y, -z


def matrix_rows(q: Any) -> list[list[Any]]:
    """Rows of the rotation matrix of a unit quaternion."""
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def outer_rows(r: Any) -> list[list[Any]]:
    """Rows of `4 q q^T`, linear in the matrix `r` of a rotation, indexed `r[i, j]`.

    Each row is a multiple of the quaternion; the one with the largest entry on the diagonal loses no digits
    (S. W. Shepperd, J. Guidance and Control 1, 223-224, 1978).
    """
    wx, wy, wz = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, yz, zx = r[0, 1] + r[1, 0], r[1, 2] + r[2, 1], r[2, 0] + r[0, 2]
    a, b, c = r[0, 0], r[1, 1], r[2, 2]
    ww, xx, yy, zz = 1 + a + b + c, 1 + a - b - c, 1 - a + b - c, 1 - a - b + c
    return [[ww, wx, wy, wz], [wx, xx, xy, zx], [wy, xy, yy, yz], [wz, zx, yz, zz]]
