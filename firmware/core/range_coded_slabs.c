/*
 * Range-coded slabs: the decoder of the op SLABS (section 7.11).
 *
 * A box has at most 16 x 16 cells. Cells and groups of voxels have a border of blank ones around
 * the box, so that no neighbour is looked for in vain.
 */
#include "internal.h"

#if VXD_SLABS

#define SIDE_BITS 4U
#define SIDE 16U                 /* cells, of a box */
#define ROW (SIDE + 2U)          /* groups, or cells, of a row with its borders */
#define FIRST (ROW + 1U)         /* the first that is no border */
#define CELLS(voxels) (((uint32_t)(voxels) + 3U) / 4U)

enum { MORE = 0, NEXT = 1, FLAG = 2, FULL = 258, GROUP = 322, SHAPE = 386 };

/* Of a cell, and of the voxels under it in the last slice of the slab before. */
enum { NOT_BLANK = 1, IS_FULL = 2, ANY_UNDER = 4, ALL_UNDER = 8 };

static struct {
    uint8_t cells[ROW * ROW];
    /* Two slices of groups: four voxels in x, the first in bit 0. */
    uint8_t slices[2][ROW * (4U * SIDE + 2U)];
} box;

/* Decode whether each cell of the slab is blank, mixed or full. */
static void decode_cells(uint32_t w, uint32_t h)
{
    for (uint32_t j = 0; j < h; j++) {
        uint8_t *cell = &box.cells[FIRST + ROW * j];

        for (uint32_t i = 0; i < w; i++, cell++) {
            const uint8_t *north = cell - ROW;
            const uint32_t under = *cell | (uint32_t)cell[1] << 8 | (uint32_t)cell[ROW] << 16;
            uint32_t state = 0;
            uint32_t c = (cell[-1] & 1U) | (north[0] & 1U) << 1 | (north[-1] & 1U) << 2 |
                         (north[1] & 1U) << 3 | (under >> 2 & 1U) << 4 | (under >> 10 & 1U) << 5 |
                         (under >> 18 & 1U) << 6 | (under & 1U) << 7;

            if (bit_of(FLAG + c)) {
                c = (cell[-1] >> 1 & 1U) | (north[0] & 2U) | (under >> 3 & 1U) << 2 |
                    (under >> 11 & 1U) << 3 | (under >> 19 & 1U) << 4 | (north[1] & 2U) << 4;
                state = bit_of(FULL + c) ? NOT_BLANK | IS_FULL : NOT_BLANK;
            }
            *cell = (uint8_t)((under & (ANY_UNDER | ALL_UNDER)) | state);
        }
    }
}

/* Note what is lit under each cell of the next slab, in the slab's last slice. */
static void look_under(const uint8_t *slice, uint32_t w, uint32_t h)
{
    for (uint32_t j = 0; j < h; j++) {
        for (uint32_t i = 0; i < w; i++) {
            const uint8_t *group = &slice[FIRST + 4U * ROW * j + i];
            uint8_t *cell = &box.cells[FIRST + ROW * j + i];
            uint32_t any = 0;
            uint32_t all = 15;

            for (uint32_t row = 0; row < 4U; row++, group += ROW) {
                any |= *group;
                all &= *group;
            }
            *cell = (uint8_t)((*cell & (NOT_BLANK | IS_FULL)) | (any != 0 ? ANY_UNDER : 0) |
                              (all == 15U ? ALL_UNDER : 0));
        }
    }
}

/* Return a group with the voxels west and east of it: six bits, the western one first. */
static uint32_t surrounded(const uint8_t *group)
{
    return (uint32_t)group[-1] >> 3 | (uint32_t)group[0] << 1 | (group[1] & 1U) << 5;
}

/* Decode a group of a mixed cell. `model` is that of the group, but for q. */
static uint32_t decode_group(const uint8_t *here, const uint8_t *below, uint32_t model)
{
    const uint32_t beside = surrounded(here - ROW);
    const uint32_t north = surrounded(below - ROW);
    const uint32_t middle = surrounded(below);
    const uint32_t south = surrounded(below + ROW);
    const uint32_t any = beside | north | middle | south;
    const uint32_t all = beside & north & middle & south;
    uint32_t west = (uint32_t)here[-1] >> 3;
    uint32_t lit = 0;

    if (any == 0 && west == 0) {
        if (!bit_of(model)) {
            return 0;
        }
    } else if (all == 63U && west == 1U && !bit_of(model + 16U)) {
        return 15;
    }
    for (uint32_t x = 0; x < 4U; x++) {
        west = bit_of(SHAPE + ((beside >> x & 7U) | (middle >> x & 7U) << 3 |
                               (south >> x & 7U) << 6 | (north >> (x + 1U) & 1U) << 9 | west << 10));
        lit |= west << x;
    }
    return lit;
}

/* Write the lit voxels of a group, of which the first is at (x, y, z). */
static bool write_group(uint32_t lit, uint32_t x, uint32_t y, uint32_t z, uint32_t pen)
{
    for (; lit != 0; lit >>= 1, x++) {
        if (lit & 1U && !write_at(x, y, z, pen)) {
            return false;
        }
    }
    return true;
}

/* Decode the slices of a slab of which the first voxel is at xyz; the last slice is slices[1]. */
static enum code decode_slab(const uint32_t xyz[3], uint32_t w, uint32_t h, uint32_t pen)
{
    decode_cells(w, h);
    for (uint32_t a = 0; a < 4U; a++) {
        for (uint32_t y = 0; y < 4U * h; y++) {
            const uint8_t *cell = &box.cells[FIRST + ROW * (y / 4U)];
            uint8_t *here = &box.slices[a & 1U][FIRST + ROW * y];
            const uint8_t *below = &box.slices[~a & 1U][FIRST + ROW * y];

            for (uint32_t i = 0; i < w; i++, here++, below++) {
                const uint32_t state = *cell++;

                *here = 0;
                if (!(state & NOT_BLANK)) {
                    continue;
                }
                *here = state & IS_FULL
                            ? 15U
                            : (uint8_t)decode_group(here, below, GROUP + y % 4U + 4U * a +
                                                                     32U * (*cell & 1U));
                if (bits_truncated()) {
                    return TRUNCATED;
                }
                if (!write_group(*here, xyz[0] + 4U * i, xyz[1] + y, xyz[2] + a, pen)) {
                    return OUTSIDE;
                }
            }
        }
    }
    look_under(box.slices[1], w, h);
    return OK;
}

enum code draw_slabs(struct decoder *d)
{
    static const uint8_t shifts[7] = {1, 1, 1, 2, 2, 2, 3};
    uint32_t cells_left = CELLS(VXD_NX) * CELLS(VXD_NY) * CELLS(VXD_NZ);

    begin_bits(d, SLABS_MODELS, shifts);
    while (bit_of(MORE)) {
        uint32_t xyz[3];
        uint32_t w;
        uint32_t h;

        xyz[0] = 4U * plain(bits_of(CELLS(VXD_NX) - 1U));
        xyz[1] = 4U * plain(bits_of(CELLS(VXD_NY) - 1U));
        xyz[2] = 4U * plain(bits_of(CELLS(VXD_NZ) - 1U));
        w = 1U + plain(SIDE_BITS);
        h = 1U + plain(SIDE_BITS);
        memset(&box, 0, sizeof box);
        do {
            enum code code;

            if (bits_truncated()) {
                return TRUNCATED;
            }
            if (w * h > cells_left) {
                return OUTSIDE;
            }
            cells_left -= w * h;
            code = decode_slab(xyz, w, h, d->pen);
            if (code != OK) {
                return code;
            }
            xyz[2] += 4U;
        } while (bit_of(NEXT));
    }
    return end_bits();
}

#endif
