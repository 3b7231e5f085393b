"""Points that have passed through triangles in a substep; see `surface_contacts`."""

from supple.numerics.adjacency import in_list
from supple.numerics.mat3 import row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.detection.surface_contacts import corners_of, direction, enter_contact, passage


@njit(cache=True)
def find_point_passages(x, x_prev, near_triangles, surfaces, apart, part, stitched, rows, entered):
    """Activate the rows of the points that have passed through a triangle; returns how many.

    Parameters
    ----------
    near_triangles : see `NearPairs.points`; apart : (p, p) see `find_edge_contacts`; for the others see `find_contacts`
    """
    point_piece, triangles, triangle_piece, closed, gaps, friction = surfaces
    normals = rows[2]
    count = 0
    for i in range(len(near_triangles)):
        p, r, t = near_triangles[i, 0], near_triangles[i, 1], near_triangles[i, 2]
        mine, its = point_piece[p], triangle_piece[t]
        if not part[0] <= t < part[1] or not apart[mine, its]:
            continue
        corners, corners0 = corners_of(x, triangles, t), corners_of(x_prev, triangles, t)
        time, side, where = passage(row(x, p), row(x_prev, p), corners, corners0, not closed[its])
        if time > 1.0 or in_list(stitched, t, p):
            continue
        n = direction(x, p, corners, where, True, side, not closed[its])
        if normals[r, 0] == n[0] and normals[r, 1] == n[1] and normals[r, 2] == n[2]:
            continue
        if mine == its:
            entered[p] = t
        enter_contact(rows, r, p, triangles, t, where, n, gaps[mine, its], friction[mine, its])
        rows[8][r] = mine != its and closed[its]
        count += 1
    return count


@njit(cache=True)
def note_point_passages(x, x_prev, near_triangles, surfaces, apart, stitched, passed):
    """Set passed[k, l] for the pieces where a point of k passed through l; for arguments see `find_point_passages`."""
    point_piece, triangles, triangle_piece, closed, _, _ = surfaces
    for i in range(len(near_triangles)):
        p, t = near_triangles[i, 0], near_triangles[i, 2]
        mine, its = point_piece[p], triangle_piece[t]
        if passed[mine, its] or not apart[mine, its] or in_list(stitched, t, p):
            continue
        corners, corners0 = corners_of(x, triangles, t), corners_of(x_prev, triangles, t)
        passed[mine, its] = passage(row(x, p), row(x_prev, p), corners, corners0, not closed[its])[0] <= 1.0
