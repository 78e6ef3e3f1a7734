/* The ops of a packet in their order, and those that draw nothing (sections 7, 7.6 and 11). */
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

#if VXD_HOLD
static enum code set_hold(struct decoder *d)
{
    /* Without ticks the op is not announced, be its operand there or not. */
    const enum code code = hold_frame(d->at != d->end ? *d->at : 0);

    if (code == OK) {
        if (d->at == d->end) {
            return TRUNCATED;
        }
        d->at++;
    }
    return code;
}
#endif

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
#if VXD_HOLD
        case 0x07:
            return set_hold(d);
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
    default:
        return draw_run(d, op);
    }
}

uint32_t apply_ops(uint32_t length)
{
    struct decoder d = {.at = packet + 3, .end = packet + length, .pen = FULL_PIXEL};

    while (d.at != d.end) {
        const uint32_t offset = (uint32_t)(d.at - packet);
        const enum code code = apply_op(&d);

        if (code != OK) {
            return REFUSED((uint32_t)code, offset);
        }
    }
    return OK;
}
