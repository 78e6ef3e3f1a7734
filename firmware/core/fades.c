/* Fades: pens along a curve, and palette entries, that blend colours (section 7.9). */
#include "internal.h"

#if VXD_FADES

#define MAX_FADE 0x100000U

/* The blend at one place; one of pens lasts until the next, so it is kept here. */
struct blend {
    const uint8_t *colors;
    uint32_t stride; /* bytes of a colour */
    uint32_t gaps;   /* between the colours: k - 1 */
    uint32_t span;   /* M */
    uint32_t color;  /* s */
    uint32_t rest;   /* r */
};

static struct {
    struct blend blend;
    uint32_t left; /* places up to the last one */
} fade;

static void begin_blend(struct blend *b, const uint8_t *colors, uint32_t k, uint32_t n,
                        uint32_t place)
{
    b->colors = colors;
    b->gaps = k - 1U;
    b->span = n > 1U ? n - 1U : 1U;
    b->color = place * b->gaps / b->span;
    b->rest = place * b->gaps - b->color * b->span;
}

static void next_place(struct blend *b)
{
    b->rest += b->gaps;
    while (b->rest >= b->span) {
        b->rest -= b->span;
        b->color++;
    }
}

/* Blend one byte; floor(x / y) of the document with all terms positive. */
static uint32_t blend_byte(const struct blend *b, uint32_t channel)
{
    const uint8_t *from = b->colors + b->stride * b->color + channel;
    const uint8_t *to = b->rest != 0 ? from + b->stride : from;

    return (2U * ((b->span - b->rest) * *from + b->rest * *to) + b->span) / (2U * b->span);
}

#if VXD_FORMAT == VXD_RGB888 || (VXD_FADE && VXD_PALETTE)
static uint32_t blend_color(const struct blend *b)
{
    return blend_byte(b, 0) | blend_byte(b, 1) << 8 | blend_byte(b, 2) << 16;
}
#endif

static uint32_t blend_pen(const struct blend *b)
{
#if VXD_FORMAT == VXD_INDEX8
    return blend_byte(b, 0);
#elif VXD_FORMAT == VXD_RGB565
    return (62U * blend_byte(b, 0) + 255U) / 510U << 11 |
           (126U * blend_byte(b, 1) + 255U) / 510U << 5 | (62U * blend_byte(b, 2) + 255U) / 510U;
#else
    return blend_color(b);
#endif
}

void begin_fade(struct decoder *d, const uint8_t *colors, uint32_t k, uint32_t n, uint32_t place)
{
    fade.blend.stride = PEN_COLOR_BYTES;
    begin_blend(&fade.blend, colors, k, n, place);
    fade.left = n - 1U - place;
    d->pen = blend_pen(&fade.blend);
    d->fading = true;
    d->joined = false;
}

void write_next(struct decoder *d, uint32_t index)
{
    write_voxel(index, d->pen);
    if (d->fading) {
        d->pen_before = d->pen;
        if (fade.left != 0) {
            fade.left--;
            next_place(&fade.blend);
            d->pen = blend_pen(&fade.blend);
        }
    }
}

void write_first(struct decoder *d, uint32_t index)
{
    if (d->fading && d->joined) {
        write_voxel(index, d->pen_before);
    } else {
        write_next(d, index);
    }
}

#if VXD_FADE
enum code set_fade(struct decoder *d)
{
    uint32_t k;
    uint32_t last;
    uint32_t place;
    enum code code;

    if (bytes_left(d) < 1U) {
        return TRUNCATED;
    }
    k = *d->at++ + 1U;
    code = get_leb128(d, &last);
    if (code != OK) {
        return code;
    }
    if (last >= MAX_FADE) {
        return COUNT;
    }
    code = get_leb128(d, &place);
    if (code != OK) {
        return code;
    }
    if (place > last) {
        return COUNT;
    }
    if (bytes_left(d) < PEN_COLOR_BYTES * k) {
        return TRUNCATED;
    }
    begin_fade(d, d->at, k, last + 1U, place);
    d->at += PEN_COLOR_BYTES * k;
    return OK;
}

#if VXD_PALETTE
enum code set_ramp(struct decoder *d)
{
    struct blend blend;
    uint32_t first;
    uint32_t m;
    uint32_t k;

    if (bytes_left(d) < 3U) {
        return TRUNCATED;
    }
    first = d->at[0];
    m = d->at[1] + 1U;
    k = d->at[2] + 1U;
    d->at += 3;
    if (bytes_left(d) < 3U * k) {
        return TRUNCATED;
    }
    if (first + m > 256U) {
        return OUTSIDE;
    }
    blend.stride = 3;
    begin_blend(&blend, d->at, k, m, 0);
    for (; m != 0; m--) {
        write_color((uint8_t)first++, blend_color(&blend));
        next_place(&blend);
    }
    d->at += 3U * k;
    return OK;
}
#endif
#endif

#endif
