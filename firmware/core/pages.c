/* The pages: voxels with their digest, the palette, and what PAGE says (sections 2.1, 8 and 10). */
#include "internal.h"

uint32_t back_digest;

#if VXD_FORMAT == VXD_INDEX8
uint32_t vxd_default_color(uint8_t entry)
{
    /* floor(255 * level / levels + 1/2) */
    uint32_t red = ((entry >> 5) * 510U + 7U) / 14U;
    uint32_t green = ((entry >> 2 & 7U) * 510U + 7U) / 14U;
    uint32_t blue = (entry & 3U) * 85U;

    return red | green << 8 | blue << 16;
}
#endif

#if VXD_DIGEST
static uint32_t mix(uint32_t index, uint32_t value)
{
    uint32_t h = index * 0x9E3779B1U + value * 0x85EBCA77U;

    h ^= h >> 15;
    h *= 0x2C1B3C6DU;
    h ^= h >> 12;
    h *= 0x297A2D39U;
    return h ^ h >> 15;
}

void write_voxel(uint32_t index, uint32_t value)
{
    const uint32_t old = vxd_get(true, index);

    if (old != 0) {
        back_digest -= mix(index, old);
    }
    if (value != 0) {
        back_digest += mix(index, value);
    }
    vxd_put(index, value);
}
#endif

#if VXD_PALETTE
#if VXD_DIGEST
static uint32_t color_term(uint8_t entry, uint32_t color)
{
    return color == vxd_default_color(entry) ? 0 : mix(VXD_VOXELS + entry, 0x1000000U + color);
}
#endif

void write_color(uint8_t entry, uint32_t color)
{
#if VXD_DIGEST
    back_digest += color_term(entry, color) - color_term(entry, vxd_get_color(entry));
#endif
    vxd_put_color(entry, color);
}
#endif

#if VXD_READ
/* Longest pixel run that an op of one byte's count has, and shortest run worth an op of its own. */
#define MAX_LITERAL 31U
#define LONG_RUN (VXD_FORMAT == VXD_MONO1 ? 24U : 4U)

/* How many voxels from `index` on, before `end`, have the same value as it. */
static uint32_t run_length(bool back, uint32_t index, uint32_t end)
{
    uint32_t value = vxd_get(back, index);
    uint32_t at = index + 1U;

    while (at < end && vxd_get(back, at) == value) {
        at++;
    }
    return at - index;
}

static uint32_t put_count(uint32_t at, uint32_t op, uint32_t count)
{
    if (count < 32U) {
        packet[at++] = (uint8_t)(op + count - 1U);
        return at;
    }
    packet[at++] = (uint8_t)(op + 31U);
    for (count -= 32U; count > 127U; count >>= 7) {
        packet[at++] = (uint8_t)(count | 128U);
    }
    packet[at++] = (uint8_t)count;
    return at;
}

static uint32_t put_pixel(uint32_t at, uint32_t value)
{
    for (uint32_t i = 0; i < PIXEL_BYTES; i++, value >>= 8) {
        packet[at++] = (uint8_t)value;
    }
    return at;
}

/* Write n pixels from `index` on as a LIT. */
static uint32_t put_literal(uint32_t at, bool back, uint32_t index, uint32_t n)
{
    at = put_count(at, 0xC0U, n);
#if VXD_FORMAT == VXD_MONO1
    for (uint32_t i = 0; i < n; i++) {
        if (i % 8U == 0) {
            packet[at++] = 0;
        }
        packet[at - 1U] = (uint8_t)(packet[at - 1U] | vxd_get(back, index + i) << i % 8U);
    }
#else
    for (uint32_t i = 0; i < n; i++) {
        at = put_pixel(at, vxd_get(back, index + i));
    }
#endif
    return at;
}

uint32_t encode_page(bool back, uint32_t start, uint32_t *count, uint32_t at)
{
    /* The longest step: an op PEN, and an op with a count of six bytes; or a LIT of one pixel. */
    const uint32_t room = (uint32_t)VXD_MAX_PAYLOAD + 3U - (7U + PIXEL_BYTES);
    const uint32_t end = start + *count;
    uint32_t index = start;

    while (index < end && at <= room) {
        uint32_t n = run_length(back, index, end);
        uint32_t value = vxd_get(back, index);

        if (value == 0 && n >= LONG_RUN / 4U + 1U) {
            at = put_count(at, 0x80U, n);
        } else if (n >= LONG_RUN) {
            packet[at++] = 0x01;
            at = put_pixel(at, value);
            at = put_count(at, 0xA0U, n);
        } else {
            uint32_t most = (uint32_t)VXD_MAX_PAYLOAD + 2U - at;

            most = VXD_FORMAT == VXD_MONO1 ? 8U * most : most / PIXEL_BYTES;
            if (most > MAX_LITERAL) {
                most = MAX_LITERAL;
            }
            for (;;) {
                uint32_t next;

                if (index + n >= end || n >= most) {
                    break;
                }
                next = run_length(back, index + n, end);
                if (next >= LONG_RUN) {
                    break;
                }
                n += next;
            }
            if (n > most) {
                n = most;
            }
            at = put_literal(at, back, index, n);
        }
        index += n;
    }
    *count = index - start;
    return at;
}
#endif
