/* The ops of the features LINE, BOX, DOTS and OCT (sections 7.3 and 7.4). */
#include "internal.h"

#if VXD_OCT || VXD_SLABS
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
    for (int32_t k = 0;; k++) {
        if (k == 0) {
            write_first(d, index_of(p));
        } else {
            write_next(d, index_of(p));
        }
        if (k == length) {
            join_fade(d, true);
            return OK;
        }
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
    for (uint32_t z = p[2]; z <= q[2]; z++) {
        for (uint32_t y = p[1]; y <= q[1]; y++) {
            uint32_t index = (uint32_t)VXD_NX * (y + (uint32_t)VXD_NY * z);

            for (uint32_t x = p[0]; x <= q[0]; x++) {
                write_voxel(index + x, d->pen);
            }
        }
    }
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

static bool fill_cube(const uint32_t xyz[3], uint32_t side, uint32_t pen)
{
    for (uint32_t z = 0; z < side; z++) {
        for (uint32_t y = 0; y < side; y++) {
            for (uint32_t x = 0; x < side; x++) {
                if (!write_at(xyz[0] + x, xyz[1] + y, xyz[2] + z, pen)) {
                    return false;
                }
            }
        }
    }
    return true;
}

/*
 * The masks come level by level, but within a level in the order of the parents: so a walk into
 * the depth needs no more than a pointer to the next mask of each level. `masks[j]` is that of the
 * level j; `state[j]` is what the walk has still to do there: the bits left of the mask.
 */
enum code draw_brick(struct decoder *d, uint32_t level)
{
    const uint8_t *masks[LEVELS + 1U];
    uint8_t rest[LEVELS + 1U];
    uint8_t child[LEVELS + 1U];
    uint32_t xyz[3];
    uint32_t nodes = 1;
    uint32_t j;

    if (bytes_left(d) < XYZ_BYTES) {
        return TRUNCATED;
    }
    get_xyz(d, xyz);
    for (j = level; j >= 1U; j--) {
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
    for (uint32_t axis = 0; axis < 3U; axis++) {
        xyz[axis] <<= level;
    }
    if (level == 0) {
        return write_at(xyz[0], xyz[1], xyz[2], d->pen) ? OK : OUTSIDE;
    }
    /* Enter the node of level j at xyz; leave it when its bits are done. */
    j = level;
    rest[j] = *masks[j]++;
    child[j] = 0;
    if (rest[j] == 0) {
        return fill_cube(xyz, 1U << j, d->pen) ? OK : OUTSIDE;
    }
    for (;;) {
        uint32_t c;
        uint32_t at[3];

        while (rest[j] == 0) {
            if (j == level) {
                return OK;
            }
            j++;
        }
        while (!(rest[j] & 1U)) {
            rest[j] >>= 1;
            child[j]++;
        }
        c = child[j];
        rest[j] >>= 1;
        child[j]++;
        /* The corner's bits below 2^j belong to the children: bit j - 1 is this one. */
        for (uint32_t axis = 0; axis < 3U; axis++) {
            xyz[axis] = (xyz[axis] >> j << j) | (c >> axis & 1U) << (j - 1U);
            at[axis] = xyz[axis];
        }
        if (j == 1U) {
            if (!write_at(at[0], at[1], at[2], d->pen)) {
                return OUTSIDE;
            }
            continue;
        }
        rest[j - 1U] = *masks[j - 1U]++;
        child[j - 1U] = 0;
        if (rest[j - 1U] == 0) {
            if (!fill_cube(at, 1U << (j - 1U), d->pen)) {
                return OUTSIDE;
            }
        } else {
            j--;
        }
    }
}
#endif
