/* The ops SKIP, RUN, LIT and DIFF, which draw n pixels in scan order (sections 7.2 and 7.5). */
#include "internal.h"

enum run { SKIP = 4, RUN = 5, LIT = 6, DIFF = 7 }; /* the highest bits of the op */

enum code get_leb128(struct decoder *d, uint32_t *value)
{
    uint32_t byte;
    uint32_t shift = 0;

    *value = 0;
    do {
        if (d->at == d->end) {
            return TRUNCATED;
        }
        byte = *d->at++;
        if (shift == 28U && byte > 15U) {
            return COUNT;
        }
        *value |= (byte & 127U) << shift;
        shift += 7U;
    } while (byte > 127U);
    return byte == 0 && shift != 7U ? COUNT : OK;
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

/* Pixels of a LIT or DIFF that share a byte. */
static uint32_t pixels_of_a_byte(enum run kind)
{
    return VXD_DIFF && kind == DIFF ? 2U : VXD_FORMAT == VXD_MONO1 ? 8U : 1U;
}

/* Find how many bytes n pixels take, which must be there, with unused bits 0. */
static enum code check_pixels(const struct decoder *d, enum run kind, uint32_t n, uint32_t *size)
{
    const uint32_t parts = pixels_of_a_byte(kind);
    const uint32_t used = n % parts;

    *size = n / parts + (used != 0);
    if (*size > bytes_left(d) / (kind == DIFF ? 1U : PIXEL_BYTES)) {
        return TRUNCATED;
    }
    if (used != 0 && d->at[*size - 1U] >> 8U / parts * used != 0) {
        return PADDING;
    }
    return OK;
}

enum code draw_run(struct decoder *d, uint32_t op)
{
    const enum run kind = (enum run)(op >> 5);
    uint32_t n;
    uint32_t size = 0;
    uint32_t index = d->cursor;
    enum code code;

    if (kind == DIFF && !VXD_DIFF) {
        return OP;
    }
    code = get_count(d, op & 31U, &n);
    if (code == OK && kind >= LIT) {
        code = check_pixels(d, kind, n, &size);
    }
    if (code != OK) {
        return code;
    }
    if (n > VXD_VOXELS - index) {
        return OUTSIDE;
    }
    d->cursor += n;
    join_fade(d, false);
    if (kind == RUN) {
        const uint32_t pen = d->pen;

        do {
            write_voxel(index++, pen);
        } while (--n != 0);
    } else if (kind == LIT || (VXD_DIFF && kind == DIFF)) {
        const uint8_t *at = d->at;

        d->at += kind == DIFF ? size : size * PIXEL_BYTES;
        end_fade(d);
        for (uint32_t i = 0; i < n; i++) {
            if (!VXD_DIFF || kind == LIT) {
                d->pen = VXD_FORMAT == VXD_MONO1 ? (uint32_t)at[i / 8U] >> i % 8U & 1U
                                                 : get_pixel(at + i * PIXEL_BYTES);
            } else {
                const uint32_t nibble = (uint32_t)at[i / 2U] >> 4U * (i % 2U) & 15U;

                d->pen = (d->pen + nibble - (nibble & 8U) * 2U) & 255U;
            }
            write_voxel(index++, d->pen);
        }
    }
    return OK;
}
