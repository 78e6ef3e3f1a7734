/* The ops that every device has, and the order in which an op is checked (sections 7 and 11). */
#include "internal.h"

uint32_t bytes_left(const struct decoder *d)
{
    return (uint32_t)(d->end - d->at);
}

uint32_t index_of(const uint32_t xyz[3])
{
    return xyz[0] + (uint32_t)VXD_NX * (xyz[1] + (uint32_t)VXD_NY * xyz[2]);
}

bool on_grid(const uint32_t xyz[3])
{
    return xyz[0] < VXD_NX && xyz[1] < VXD_NY && xyz[2] < VXD_NZ;
}

void cursor_xyz(const struct decoder *d, uint32_t xyz[3])
{
    uint32_t row = d->cursor / VXD_NX;

    xyz[0] = d->cursor - row * VXD_NX;
    xyz[2] = row / VXD_NY;
    xyz[1] = row - xyz[2] * VXD_NY;
}

void get_xyz(struct decoder *d, uint32_t xyz[3])
{
    for (uint32_t axis = 0; axis < 3U; axis++) {
        xyz[axis] = WIDE ? get_u16(d->at) : *d->at;
        d->at += COORDINATE_BYTES;
    }
}

uint32_t get_pixel(const uint8_t *bytes)
{
    uint32_t value = bytes[0];

    for (uint32_t i = 1; i < PIXEL_BYTES; i++) {
        value |= (uint32_t)bytes[i] << 8U * i;
    }
    return value;
}

static enum code check_end(struct decoder *d)
{
    while (d->at != d->end) {
        if (*d->at++ != 0) {
            return PADDING;
        }
    }
    return OK;
}

static enum code set_pen(struct decoder *d)
{
    uint32_t value;

    if (bytes_left(d) < PIXEL_BYTES) {
        return TRUNCATED;
    }
    value = get_pixel(d->at);
    if (VXD_FORMAT == VXD_MONO1 && value > 1U) {
        return PIXEL;
    }
    d->at += PIXEL_BYTES;
    d->pen = value;
    end_fade(d);
    return OK;
}

static enum code move(struct decoder *d)
{
    uint32_t xyz[3];

    if (bytes_left(d) < XYZ_BYTES) {
        return TRUNCATED;
    }
    get_xyz(d, xyz);
    if (!on_grid(xyz)) {
        return OUTSIDE;
    }
    d->cursor = index_of(xyz);
    join_fade(d, false);
    return OK;
}

#if VXD_PALETTE
static enum code set_colors(struct decoder *d)
{
    uint32_t first;
    uint32_t n;

    if (bytes_left(d) < 2U) {
        return TRUNCATED;
    }
    first = d->at[0];
    n = d->at[1] + 1U;
    d->at += 2;
    if (bytes_left(d) < 3U * n) {
        return TRUNCATED;
    }
    if (first + n > 256U) {
        return OUTSIDE;
    }
    for (; n != 0; n--, d->at += 3) {
        write_color((uint8_t)first++, get_u16(d->at) | (uint32_t)d->at[2] << 16);
    }
    return OK;
}
#endif

/* STEP and FROM: a chain in one octant (section 7.1). */
static enum code draw_chain(struct decoder *d, uint32_t octant, bool from)
{
    static const uint32_t side[3] = {VXD_NX, VXD_NY, VXD_NZ};
    static const uint32_t stride[3] = {1, VXD_NX, (uint32_t)VXD_NX * VXD_NY};
    uint32_t xyz[3];
    uint32_t n;
    uint32_t axis = octant >> 3;

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
    write_first(d, d->cursor);
    for (uint32_t i = 0; i < n; i++) {
        /* bit 0: the main axis; bits 1 and 2: the axes after it, in a circle */
        uint32_t moves = (uint32_t)d->at[i / 4U] >> 2U * (i % 4U) << 1 | 1U;

        for (uint32_t j = 0; j < 3U; j++) {
            if (moves >> j & 1U) {
                if (octant >> axis & 1U) {
                    xyz[axis]--;
                    d->cursor -= stride[axis];
                } else {
                    xyz[axis]++;
                    d->cursor += stride[axis];
                }
                if (xyz[axis] >= side[axis]) {
                    return OUTSIDE;
                }
            }
            axis = axis == 2U ? 0 : axis + 1U;
        }
        write_next(d, d->cursor);
    }
    d->at += (n + 3U) / 4U;
    join_fade(d, true);
    return OK;
}

enum code get_leb128(struct decoder *d, uint32_t *value)
{
    uint32_t byte;

    *value = 0;
    for (uint32_t shift = 0;; shift += 7U) {
        if (d->at == d->end) {
            return TRUNCATED;
        }
        byte = *d->at++;
        if (shift == 28U && byte > 15U) {
            return COUNT;
        }
        *value |= (byte & 127U) << shift;
        if (byte < 128U) {
            return byte == 0 && shift != 0 ? COUNT : OK;
        }
    }
}

/* Decode a count (section 7.2), whose first five bits are in the op byte. */
static enum code get_count(struct decoder *d, uint32_t bits, uint32_t *n)
{
    enum code code = OK;

    *n = bits + 1U;
    if (bits == 31U) {
        code = get_leb128(d, n);
        *n += 32U;
        if (code == OK && *n < 32U) {
            code = COUNT;
        }
    }
    return code;
}

/* SKIP, RUN, LIT and DIFF: n pixels in scan order. */
static enum code draw_run(struct decoder *d, uint32_t op)
{
    const uint32_t kind = op >> 5;
    uint32_t n;
    uint32_t size = 0;
    enum code code = get_count(d, op & 31U, &n);

    if (code != OK) {
        return code;
    }
    if (kind >= 6U) {
        const uint32_t parts = kind == 7U ? 2U : VXD_FORMAT == VXD_MONO1 ? 8U : 1U;

        size = n / parts + (n % parts != 0);
        if (kind == 6U) {
            if (size > bytes_left(d) / PIXEL_BYTES) {
                return TRUNCATED;
            }
            size *= PIXEL_BYTES;
        } else if (size > bytes_left(d)) {
            return TRUNCATED;
        }
        if (n % parts != 0 && d->at[size - 1U] >> 8U / parts * (n % parts) != 0) {
            return PADDING;
        }
    }
    if (n > VXD_VOXELS - d->cursor) {
        return OUTSIDE;
    }
    join_fade(d, false);
    if (kind >= 6U) {
        end_fade(d);
    }
    if (kind == 4U) {
        d->cursor += n;
        return OK;
    }
    for (uint32_t i = 0; i < n; i++) {
        if (kind == 6U) {
            d->pen = VXD_FORMAT == VXD_MONO1 ? (uint32_t)d->at[i / 8U] >> i % 8U & 1U
                                             : get_pixel(d->at + i * PIXEL_BYTES);
        }
#if VXD_DIFF
        if (kind == 7U) {
            uint32_t nibble = (uint32_t)d->at[i / 2U] >> 4U * (i % 2U) & 15U;

            d->pen = (d->pen + nibble - (nibble & 8U) * 2U) & 255U;
        }
#endif
        write_voxel(d->cursor++, d->pen);
    }
    d->at += size;
    return OK;
}

static enum code apply_op(struct decoder *d)
{
    const uint32_t op = *d->at++;
    const uint32_t low = op & 31U;

    switch (op >> 5) {
    case 0:
        switch (op) {
        case 0x00:
            return check_end(d);
        case 0x01:
            return set_pen(d);
        case 0x02:
            return move(d);
#if VXD_LINE
        case 0x03:
            return draw_line(d);
#endif
#if VXD_BOX
        case 0x04:
            return draw_box(d);
#endif
#if VXD_DOTS
        case 0x05:
            return draw_dots(d);
#endif
#if VXD_PALETTE
        case 0x06:
            return set_colors(d);
#endif
#if VXD_FADE
        case 0x08:
            return set_fade(d);
#if VXD_PALETTE
        case 0x09:
            return set_ramp(d);
#endif
#endif
        default:
            return OP;
        }
    case 1:
    case 2:
#if VXD_ARC
        if (op == 0x58U) {
            return draw_arc(d, false);
        }
#endif
#if VXD_SLABS
        if (op == 0x59U) {
            return draw_slabs(d);
        }
#endif
#if VXD_ARC2
        if (op == 0x5AU) {
            return draw_arc(d, true);
        }
#endif
        return low > 23U ? OP : draw_chain(d, low, op >> 5 == 2U);
    case 3:
#if VXD_OCT
        return low > 4U ? OP : draw_brick(d, low);
#else
        return OP;
#endif
    case 7:
        if (!VXD_DIFF) {
            return OP;
        }
        return draw_run(d, op);
    default:
        return draw_run(d, op);
    }
}

enum code apply_ops(const uint8_t *payload, uint32_t length, uint32_t *offset)
{
    struct decoder d = {.at = payload, .end = payload + length, .pen = FULL_PIXEL};
    enum code code = OK;

    while (code == OK && d.at != d.end) {
        *offset = (uint32_t)(d.at - payload);
        code = apply_op(&d);
    }
    return code;
}
