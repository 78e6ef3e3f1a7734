"""Meshes voxelised by the rules in rational numbers, one mid-line and one triangle at a time.

Shares nothing with the package: coordinates are whole multiples of 1/4 voxel, fractions are exact.
"""

import itertools
import random
from fractions import Fraction
from math import floor

HALF = Fraction(1, 2)

# Closed surfaces, oriented outwards for vertices in their usual places.
TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
CUBE = [
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
    (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
]  # fmt: skip
OCTAHEDRON = [
    (0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5),
]  # fmt: skip
TORUS = [
    triangle
    for i in range(3)
    for j in range(3)
    for a, b, c, d in [
        (3 * i + j, 3 * ((i + 1) % 3) + j, 3 * ((i + 1) % 3) + (j + 1) % 3, 3 * i + (j + 1) % 3)
    ]
    for triangle in ((a, b, c), (a, c, d))
]
SURFACES = [(4, TETRAHEDRON), (8, CUBE), (6, OCTAHEDRON), (9, TORUS)]


def random_closed_mesh(chance: random.Random, sides=(7, 6, 5), step=Fraction(1, 4), thin=0.3):
    """Vertices and faces of a closed, oriented surface that may intersect itself."""
    count, faces = chance.choice(SURFACES)
    low, high = [Fraction(-1)] * 3, [Fraction(side + 1) for side in sides]
    for axis in range(3):
        if chance.random() < thin:  # thinner than a voxel, perhaps
            low[axis] = chance.randrange(4 * sides[axis]) * Fraction(1, 4)
            high[axis] = low[axis] + Fraction(chance.randrange(1, 5), 4)
    if count == 8 and chance.random() < 0.7:  # a box
        spans = zip(low, high, strict=True)
        ends = [sorted(lattice_point(chance, *span, step) for _ in range(2)) for span in spans]
        vertices = [tuple(ends[k][index >> k & 1] for k in range(3)) for index in range(8)]
    else:
        vertices = [
            tuple(lattice_point(chance, a, b, step) for a, b in zip(low, high, strict=True))
            for _ in range(count)
        ]
    return vertices, list(faces)


def lattice_point(chance, low, high, step):
    return low + step * chance.randrange(int((high - low) / step) + 1)


def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def dot(a, b):
    return sum(p * q for p, q in zip(a, b, strict=True))


def minus(a, b):
    return tuple(p - q for p, q in zip(a, b, strict=True))


def normal(triangle):
    a, b, c = triangle
    return cross(minus(b, a), minus(c, a))


def corners_of(vertices, faces):
    """Triangles with an area."""
    triangles = [tuple(vertices[k] for k in face) for face in faces]
    return [triangle for triangle in triangles if any(normal(triangle))]


def net_edges(triangles):
    """Return how much more often each edge is run along in one direction than in the other."""
    net = {}
    for triangle in triangles:
        for k in range(3):
            a, b = triangle[k], triangle[(k + 1) % 3]
            if a == b:
                continue
            net[a, b] = net.get((a, b), 0) + 1
            net[b, a] = net.get((b, a), 0) - 1
    return net


def is_oriented(vertices, faces):
    """Return whether all edges cancel, perhaps with the help of triangles that have no area."""
    given = [tuple(vertices[k] for k in face) for face in faces]
    return any(
        not any(net_edges(triangles).values()) for triangles in (given, corners_of(vertices, faces))
    )


def volume_sign(triangles):
    volume = sum(dot(a, cross(b, c)) for a, b, c in triangles)
    return (volume > 0) - (volume < 0)


def crossing(triangle, axis, at):
    """Coordinate along an axis where a mid-line at (u, v) meets a closed triangle, or None."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    n = normal(triangle)
    if n[axis] == 0:
        return None
    for k in range(3):
        a, b = triangle[k], triangle[(k + 1) % 3]
        side = (b[u] - a[u]) * (at[1] - a[v]) - (b[v] - a[v]) * (at[0] - a[u])
        if side * n[axis] < 0:
            return None
    a = triangle[0]
    return a[axis] - (n[u] * (at[0] - a[u]) + n[v] * (at[1] - a[v])) / n[axis]


def reference_shell(vertices, faces, sides):
    """Voxels that the triangles light, and those of thin parts, of a mesh."""
    triangles = corners_of(vertices, faces)
    single = list({frozenset(triangle): triangle for triangle in triangles}.values())
    # Two sides that coincide are one open sheet.
    oriented = len(single) == len(triangles) and is_oriented(vertices, faces)
    triangles = single
    outward = volume_sign(triangles) if oriented else 0
    lit = set()
    # One voxel more on all sides, as is thin parts' due.
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for i in range(-1, sides[u] + 1):
            for j in range(-1, sides[v] + 1):
                for triangle in triangles:
                    depth = crossing(triangle, axis, (i + HALF, j + HALF))
                    if depth is None:
                        continue
                    level = floor(depth)
                    if level == depth and outward:
                        level -= normal(triangle)[axis] * outward > 0
                    elif level == depth == sides[axis]:
                        level -= 1
                    voxel = [0, 0, 0]
                    voxel[axis], voxel[u], voxel[v] = level, i, j
                    lit.add(tuple(voxel))
    inner = [range(-1, side + 1) for side in sides]
    lit = {voxel for voxel in lit if all(k in r for k, r in zip(voxel, inner, strict=True))}
    return lit, lit | thin_parts(triangles, lit, sides, oriented)


def shape_edges(triangles):
    """Edges but those between two coplanar triangles on either side."""
    around = {}
    for triangle in triangles:
        for k in range(3):
            edge = frozenset((triangle[k], triangle[(k + 1) % 3]))
            around.setdefault(edge, []).append(triangle)
    for edge, sharing in around.items():
        if len(sharing) == 2:
            a, b = edge
            c, d = (next(p for p in triangle if p not in edge) for triangle in sharing)
            one, other = cross(minus(b, a), minus(c, a)), cross(minus(b, a), minus(d, a))
            if dot(one, minus(d, a)) == 0 and dot(one, other) < 0:
                continue
        yield tuple(edge)


def centre_corners(point):
    """Voxels whose centres are the corners of the smallest dual element around a point."""
    options = []
    for coordinate in point:
        below = floor(coordinate - HALF)
        options.append({below} if below + HALF == coordinate else {below, below + 1})
    return list(itertools.product(*options))


def thin_parts(triangles, lit, sides, oriented):  # noqa: C901 - one rule after the other
    meetings = {}
    for a, b in shape_edges(triangles):
        for axis in range(3):
            if a[axis] == b[axis]:
                continue
            for plane in range(-1, sides[axis] + 1):
                share = (plane + HALF - a[axis]) / (b[axis] - a[axis])
                if 0 <= share <= 1:
                    point = tuple(p + share * (q - p) for p, q in zip(a, b, strict=True))
                    corners = tuple(sorted(centre_corners(point)))
                    meetings.setdefault((axis, corners), set()).add(point)
    grid = set(itertools.product(*(range(-1, side + 1) for side in sides)))
    more = set()
    for (_, corners), points in meetings.items():
        if not lit & set(corners):
            more |= nearest(corners, points, sides, oriented) & grid
    done = lit | more
    grains = {}
    for triangle in triangles:
        cells = [set(centre_corners(point)) for point in triangle]
        spans = [
            {floor(p[k] - HALF) for p in triangle} | {-floor(HALF - p[k]) - 1 for p in triangle}
            for k in range(3)
        ]
        flat = [len({p[k] for p in triangle}) == 1 for k in range(3)]
        if all(len(span) == 1 or on for span, on in zip(spans, flat, strict=True)):
            corners = tuple(sorted(set.intersection(*cells)))
            if all(tuple(map(floor, p)) in grid for p in triangle):
                grains.setdefault(corners, []).extend(triangle)
    for corners, points in grains.items():
        if not done & set(corners):
            middle = tuple(
                (min(p[k] for p in points) + max(p[k] for p in points)) / 2 for k in range(3)
            )
            more |= nearest(corners, {middle}, sides, oriented) & grid
    return more


def nearest(corners, points, sides, oriented):
    distance = {
        corner: min(
            sum((k + HALF - c) ** 2 for k, c in zip(corner, point, strict=True)) for point in points
        )
        for corner in corners
    }
    best = {corner for corner in corners if distance[corner] == min(distance.values())}
    if oriented:
        return best
    # The upper one, but none beyond the upper wall.
    return {max(best, key=lambda v: (all(k < n for k, n in zip(v, sides, strict=True)), v))}


def winding(vertices, faces, voxel):
    """Winding number about a voxel's centre; the mesh lies an infinitesimal step lower."""
    total = 0
    x, y, z = (k + HALF for k in voxel)
    for a, b, c in corners_of(vertices, faces):
        n = normal((a, b, c))[2]
        if n == 0:
            continue
        order = (a, b, c) if n > 0 else (a, c, b)
        inside = True
        for k in range(3):
            p, q = order[k], order[(k + 1) % 3]
            du, dv = q[0] - p[0], q[1] - p[1]
            side = du * (y - p[1]) - dv * (x - p[0])
            owned = dv < 0 or (dv == 0 and du > 0)
            inside &= side > 0 or (side == 0 and owned)
        if inside:
            depth = crossing((a, b, c), 2, (x, y))
            if depth <= z:
                total += -1 if n > 0 else 1
    return total
