/* Chains: the ops STEP and FROM (section 7.1). */
#include "internal.h"

enum code draw_chain(struct decoder *d, uint32_t octant, bool from)
{
    static const uint32_t side[3] = {VXD_NX, VXD_NY, VXD_NZ};
    static const uint32_t stride[3] = {1, VXD_NX, (uint32_t)VXD_NX * VXD_NY};
    uint32_t xyz[3];
    uint32_t way[3];  /* of the index, on the main axis and those after it, in a circle */
    uint32_t room[3]; /* steps up to the border */
    uint32_t axis = octant >> 3;
    uint32_t index;
    uint32_t n;

    if (bytes_left(d) < (from ? XYZ_BYTES : 0U) + 1U) {
        return TRUNCATED;
    }
    if (from) {
        get_xyz(d, xyz);
    }
    n = *d->at++ + 1U;
    if (bytes_left(d) < (n + 3U) / 4U) {
        return TRUNCATED;
    }
    if (n % 4U != 0 && d->at[n / 4U] >> 2U * (n % 4U) != 0) {
        return PADDING;
    }
    if (from) {
        if (!on_grid(xyz)) {
            return OUTSIDE;
        }
        d->cursor = index_of(xyz);
        join_fade(d, false);
    } else {
        if (d->cursor == VXD_VOXELS) {
            return OUTSIDE;
        }
        cursor_xyz(d, xyz);
    }
    for (uint32_t j = 0; j < 3U; j++) {
        way[j] = stride[axis];
        room[j] = side[axis] - 1U - xyz[axis];
        if (octant >> axis & 1U) {
            way[j] = 0U - way[j];
            room[j] = xyz[axis];
        }
        axis = axis == 2U ? 0 : axis + 1U;
    }
    if (n > room[0]) {
        return OUTSIDE;
    }
    index = d->cursor;
    write_first(d, index);
    while (n != 0) {
        const uint32_t count = n < 4U ? n : 4U;
        uint32_t crumbs = *d->at++ | 1U << 2U * count; /* the bit behind them ends the loop */

        n -= count;
        do {
            index += way[0];
            if (crumbs & 1U) {
                index += way[1];
                if (room[1]-- == 0) {
                    return OUTSIDE;
                }
            }
            if (crumbs & 2U) {
                index += way[2];
                if (room[2]-- == 0) {
                    return OUTSIDE;
                }
            }
            write_next(d, index);
            crumbs >>= 2;
        } while (crumbs != 1U);
    }
    d->cursor = index;
    join_fade(d, true);
    return OK;
}
