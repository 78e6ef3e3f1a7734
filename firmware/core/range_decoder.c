/* The adaptive binary range decoder of ARC, ARC2 and SLABS (section 7.7, "Bits"). */
#include "internal.h"

#if VXD_RANGE_CODED

#define BEHIND 3U
#define HALF 2048U
#define ENOUGH 6U

/* A model is its chance of a 0, of 4096, times 8, and how many bits it has seen, at most ENOUGH. */
static struct {
    uint32_t range;
    uint32_t code;
    uint32_t behind; /* bytes read behind the payload; above BEHIND the op is truncated */
    const uint8_t *next_byte;
    const uint8_t *payload_end;
    const uint8_t *shifts; /* by the bits that a model has seen */
    uint16_t model[RANGE_MODELS];
} bits;

static void shift_in(void)
{
    uint32_t byte = 0;

    if (bits.next_byte != bits.payload_end) {
        byte = *bits.next_byte++;
    } else {
        bits.behind++;
    }
    bits.code = bits.code << 8 | byte;
}

void begin_bits(struct decoder *d, uint32_t models, const uint8_t shifts[7])
{
    for (uint32_t i = 0; i < models; i++) {
        bits.model[i] = HALF << 3;
    }
    bits.shifts = shifts;
    bits.range = (uint32_t)1 << 24;
    bits.code = 0;
    bits.behind = 0;
    bits.next_byte = d->at;
    bits.payload_end = d->at = d->end;
    shift_in();
    shift_in();
    shift_in();
}

bool bits_truncated(void)
{
    return bits.behind > BEHIND;
}

enum code end_bits(void)
{
    return bits.behind > BEHIND ? TRUNCATED : bits.behind == BEHIND ? OK : PADDING;
}

static uint32_t split(uint32_t chance)
{
    const uint32_t bound = (bits.range >> 13) * chance;
    uint32_t bit = bits.code >= bound;

    if (bit) {
        bits.code -= bound;
        bits.range -= bound;
    } else {
        bits.range = bound;
    }
    while (bits.range < (uint32_t)1 << 24) {
        bits.range <<= 8;
        shift_in();
    }
    return bit;
}

static void learn(uint32_t i, uint32_t bit)
{
    uint32_t p = bits.model[i] >> 3;
    uint32_t seen = bits.model[i] & 7U;
    uint32_t shift = bits.shifts[seen];

    p = bit ? p - (p >> shift) : p + ((4096U - p) >> shift);
    bits.model[i] = (uint16_t)(p << 3 | (seen < ENOUGH ? seen + 1U : seen));
}

#if VXD_CHAINS
uint32_t bit_of_two(uint32_t i, uint32_t j)
{
    uint32_t bit = split((uint32_t)(bits.model[i] >> 3) + (bits.model[j] >> 3));

    learn(i, bit);
    learn(j, bit);
    return bit;
}
#endif

uint32_t bit_of(uint32_t i)
{
    uint32_t bit = split(2U * (bits.model[i] >> 3));

    learn(i, bit);
    return bit;
}

uint32_t plain(uint32_t count)
{
    uint32_t value = 0;

    for (; count != 0; count--) {
        value = value << 1 | split(2U * HALF);
    }
    return value;
}

uint32_t bits_of(uint32_t number)
{
    uint32_t count = 0;

    for (; number != 0; number >>= 1) {
        count++;
    }
    return count;
}

#endif
