/* The ops of the features LINE, BOX, DOTS and OCT (sections 7.3 and 7.4). */
#include "internal.h"

#if VXD_SLABS
bool write_at(uint32_t x, uint32_t y, uint32_t z, uint32_t pen)
{
    const uint32_t xyz[3] = {x, y, z};

    if (!on_grid(xyz)) {
        return false;
    }
    write_voxel(index_of(xyz), pen);
    return true;
}
#endif

#if VXD_LINE || VXD_BOX
/* Read the voxel that LINE and BOX name, and the cursor's own. */
static enum code get_ends(struct decoder *d, uint32_t p[3], uint32_t q[3])
{
    if (bytes_left(d) < XYZ_BYTES) {
        return TRUNCATED;
    }
    get_xyz(d, q);
    if (!on_grid(q) || d->cursor == VXD_VOXELS) {
        return OUTSIDE;
    }
    cursor_xyz(d, p);
    d->cursor = index_of(q);
    return OK;
}
#endif

#if VXD_LINE
enum code draw_line(struct decoder *d)
{
    uint32_t p[3];
    uint32_t q[3];
    int32_t rest[3];
    int32_t length = 0;
    enum code code = get_ends(d, p, q);

    if (code != OK) {
        return code;
    }
    for (uint32_t axis = 0; axis < 3U; axis++) {
        int32_t delta = (int32_t)q[axis] - (int32_t)p[axis];

        if (delta < 0) {
            delta = -delta;
        }
        if (delta > length) {
            length = delta;
        }
        q[axis] -= p[axis];
    }
    /* rest is (2 k d + L) mod 2 L on each axis; p has the quotient. */
    rest[0] = rest[1] = rest[2] = length;
    write_first(d, index_of(p));
    for (int32_t k = 0; k < length; k++) {
        for (uint32_t axis = 0; axis < 3U; axis++) {
            rest[axis] += 2 * (int32_t)q[axis];
            if (rest[axis] >= 2 * length) {
                rest[axis] -= 2 * length;
                p[axis]++;
            } else if (rest[axis] < 0) {
                rest[axis] += 2 * length;
                p[axis]--;
            }
        }
        write_next(d, index_of(p));
    }
    join_fade(d, true);
    return OK;
}
#endif

#if VXD_BOX || VXD_OCT
/* Write the pen to all voxels from p to q, of which no coordinate is below that of p. */
static void fill_box(const uint32_t p[3], const uint32_t q[3], uint32_t pen)
{
    for (uint32_t z = p[2]; z <= q[2]; z++) {
        for (uint32_t y = p[1]; y <= q[1]; y++) {
            const uint32_t row = (uint32_t)VXD_NX * (y + (uint32_t)VXD_NY * z);

            for (uint32_t x = p[0]; x <= q[0]; x++) {
                write_voxel(row + x, pen);
            }
        }
    }
}
#endif

#if VXD_BOX
enum code draw_box(struct decoder *d)
{
    uint32_t p[3];
    uint32_t q[3];
    enum code code = get_ends(d, p, q);

    if (code != OK) {
        return code;
    }
    join_fade(d, false);
    for (uint32_t axis = 0; axis < 3U; axis++) {
        if (p[axis] > q[axis]) {
            const uint32_t low = q[axis];

            q[axis] = p[axis];
            p[axis] = low;
        }
    }
    fill_box(p, q, d->pen);
    return OK;
}
#endif

#if VXD_DOTS
enum code draw_dots(struct decoder *d)
{
    uint32_t n;

    if (bytes_left(d) < 1U) {
        return TRUNCATED;
    }
    n = *d->at++ + 1U;
    if (bytes_left(d) < n * XYZ_BYTES) {
        return TRUNCATED;
    }
    for (; n != 0; n--) {
        uint32_t xyz[3];

        get_xyz(d, xyz);
        if (!on_grid(xyz)) {
            return OUTSIDE;
        }
        d->cursor = index_of(xyz);
        write_next(d, d->cursor);
    }
    join_fade(d, true);
    return OK;
}
#endif

#if VXD_OCT
#define LEVELS 4U

/*
 * The masks come level by level, but within a level in the order of the parents: so a walk into
 * the depth needs no more than a pointer to the next mask of each level. `masks[j]` is that of the
 * level j; `rest[j]` are the children there that are still to be drawn. The brick is the only
 * child of a level above it.
 */
enum code draw_brick(struct decoder *d, uint32_t level)
{
    const uint8_t *masks[LEVELS + 1U];
    uint32_t rest[LEVELS + 2U];
    uint32_t place[3] = {0, 0, 0}; /* within the brick */
    uint32_t brick[3];
    uint32_t nodes = 1;
    uint32_t j;

    if (bytes_left(d) < XYZ_BYTES) {
        return TRUNCATED;
    }
    get_xyz(d, brick);
    for (j = level; j != 0; j--) {
        uint32_t children = 0;

        if (bytes_left(d) < nodes) {
            return TRUNCATED;
        }
        masks[j] = d->at;
        for (; nodes != 0; nodes--) {
            for (uint32_t mask = *d->at++; mask != 0; mask &= mask - 1U) {
                children++;
            }
        }
        nodes = children;
    }
    j = level + 1U;
    rest[j] = 1;
    for (;;) {
        uint32_t p[3];
        uint32_t q[3];
        uint32_t child = 0;

        while (rest[j] == 0) {
            if (j++ > level) {
                return OK;
            }
        }
        while (!(rest[j] >> child & 1U)) {
            child++;
        }
        rest[j] &= rest[j] - 1U;
        j--;
        for (uint32_t axis = 0; axis < 3U; axis++) {
            /* The bits below belong to the child's own children. */
            place[axis] = (place[axis] >> 1 >> j << 1 | (child >> axis & 1U)) << j;
            p[axis] = (brick[axis] << level) + place[axis];
            q[axis] = p[axis] + (1U << j) - 1U;
        }
        rest[j] = j != 0 ? *masks[j]++ : 0;
        if (rest[j] == 0) {
            if (!on_grid(q)) {
                return OUTSIDE;
            }
            fill_box(p, q, d->pen);
        }
    }
}
#endif
