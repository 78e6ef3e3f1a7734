/* Range-coded chains: the decoder of the op ARC (section 7.7). */
#include "internal.h"

#if VXD_ARC

#define BEHIND 3U
#define MAX_RUN 255U

enum { MORE = 0, JUMP = 1, INK = 2, NUMBER = 3, LONE = 18, TURN = 26, MAIN = 42, HISTORY = 74,
       RUNS = 138, MODELS = 266 };

/* What one axis remembers of the steps before. */
struct axis {
    uint8_t last;
    uint8_t run;
    uint8_t prev;
    uint8_t prev2;
    uint8_t past;
    int8_t way;
};

/* A model is its chance of a 0, of 4096, times 8, and how many bits it has seen, at most 6. */
static struct {
    uint32_t range;
    uint32_t code;
    uint32_t behind; /* bytes read behind the payload; above BEHIND the op is truncated */
    const uint8_t *next_byte;
    const uint8_t *payload_end;
    struct axis axes[3];
    uint16_t model[MODELS];
} arc;

static void shift_in(void)
{
    uint32_t byte = 0;

    if (arc.next_byte != arc.payload_end) {
        byte = *arc.next_byte++;
    } else {
        arc.behind++; /* above BEHIND the op is truncated */
    }
    arc.code = arc.code << 8 | byte;
}

static uint32_t split(uint32_t bound)
{
    uint32_t bit = arc.code >= bound;

    if (bit) {
        arc.code -= bound;
        arc.range -= bound;
    } else {
        arc.range = bound;
    }
    while (arc.range < (uint32_t)1 << 24) {
        arc.range <<= 8;
        shift_in();
    }
    return bit;
}

static void learn(uint32_t i, uint32_t bit)
{
    uint32_t p = arc.model[i] >> 3;
    uint32_t seen = arc.model[i] & 7U;
    uint32_t shift = 1U + (seen >> 1);

    p = bit ? p - (p >> shift) : p + ((4096U - p) >> shift);
    arc.model[i] = (uint16_t)(p << 3 | (seen < 6U ? seen + 1U : seen));
}

static uint32_t bit_of_two(uint32_t i, uint32_t j)
{
    uint32_t bit = split((arc.range >> 13) * ((uint32_t)(arc.model[i] >> 3) + (arc.model[j] >> 3)));

    learn(i, bit);
    if (j != i) {
        learn(j, bit);
    }
    return bit;
}

static uint32_t bit_of(uint32_t i)
{
    return bit_of_two(i, i);
}

static uint32_t plain(uint32_t bits)
{
    uint32_t value = 0;

    for (; bits != 0; bits--) {
        value = value << 1 | split((arc.range >> 13) * 4096U);
    }
    return value;
}

static uint32_t number(void)
{
    uint32_t k = 0;

    while (k < 15U && bit_of(NUMBER + k)) {
        k++;
    }
    return (1U << k) - 1U + plain(k);
}

static uint32_t bits_of(uint32_t m)
{
    uint32_t bits = 0;

    for (; m != 0; m >>= 1) {
        bits++;
    }
    return bits;
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static uint32_t streak(const struct axis *a)
{
    return a->last ? a->run : 0;
}

/* Whether an axis beside the main one moves in a step in which that one does. */
static uint32_t moves_beside(const struct axis *a)
{
    uint32_t h = a->past >> 1;
    uint32_t d;

    if (a->last) {
        h ^= 63U;
    }
    if (a->run > a->prev2) {
        d = 3U;
    } else {
        d = 2U - least(2U, (uint32_t)a->prev2 - a->run);
    }
    return a->last ^ bit_of_two(HISTORY + h, RUNS + 64U * a->last + 16U * d +
                                                 8U * (a->prev > 1U) + least(a->run, 7U));
}

/* Decode the direction of an axis that moves, and move the coordinate. */
static void turn_and_go(struct axis *a, uint32_t *coordinate)
{
    if (a->way == 0) {
        a->way = plain(1) ? -1 : 1;
    } else if (bit_of(TURN + (a->last ? 0 : least(a->run, 15U)))) {
        a->way = (int8_t)-a->way;
    }
    *coordinate += a->way < 0 ? 0xFFFFFFFFU : 1U;
}

static void record(struct axis *a, uint32_t moved)
{
    a->past = (uint8_t)(((uint32_t)a->past << 1 | moved) & 127U);
    if (moved == a->last) {
        if (a->run < MAX_RUN) {
            a->run++;
        }
    } else {
        a->prev2 = a->prev;
        a->prev = a->run;
        a->run = 1;
        a->last = (uint8_t)moved;
    }
}

static void step(uint32_t xyz[3])
{
    uint32_t m = 0;
    uint32_t b;
    uint32_t c;
    uint32_t moved[3];

    for (uint32_t i = 1; i < 3U; i++) {
        if (streak(&arc.axes[i]) > streak(&arc.axes[m])) {
            m = i;
        }
    }
    b = m == 2U ? 0 : m + 1U;
    c = b == 2U ? 0 : b + 1U;
    {
        uint32_t longer = streak(&arc.axes[b]);

        if (streak(&arc.axes[c]) > longer) {
            longer = streak(&arc.axes[c]);
        }
        moved[m] = bit_of(MAIN + 8U * least(streak(&arc.axes[m]), 3U) + least(longer, 7U));
    }
    if (moved[m]) {
        turn_and_go(&arc.axes[m], &xyz[m]);
        moved[b] = moves_beside(&arc.axes[b]);
    } else {
        moved[b] = bit_of(LONE + least(streak(&arc.axes[b]), 7U));
    }
    if (moved[b]) {
        turn_and_go(&arc.axes[b], &xyz[b]);
    }
    if (moved[m]) {
        moved[c] = moves_beside(&arc.axes[c]);
    } else {
        moved[c] = moved[b] ? bit_of(LONE + least(streak(&arc.axes[c]), 7U)) : 1U;
    }
    if (moved[c]) {
        turn_and_go(&arc.axes[c], &xyz[c]);
    }
    for (uint32_t i = 0; i < 3U; i++) {
        record(&arc.axes[i], moved[i]);
    }
}

enum code draw_arc(struct decoder *d)
{
    uint32_t xyz[3] = {0, 0, 0};
    bool first = true;

    for (uint32_t i = 0; i < MODELS; i++) {
        arc.model[i] = 2048U << 3;
    }
    arc.range = (uint32_t)1 << 24;
    arc.code = 0;
    arc.behind = 0;
    arc.next_byte = d->at;
    arc.payload_end = d->end;
    d->at = d->end;
    shift_in();
    shift_in();
    shift_in();
    while (bit_of(MORE)) {
        bool jump = first || bit_of(JUMP);
        uint32_t n;

        first = false;
        if (bit_of(INK)) {
            d->pen = plain(VXD_FORMAT == VXD_MONO1 ? 1U : 8U * PIXEL_BYTES);
        }
        if (jump) {
            xyz[0] = plain(bits_of(VXD_NX - 1U));
            xyz[1] = plain(bits_of(VXD_NY - 1U));
            xyz[2] = plain(bits_of(VXD_NZ - 1U));
            for (uint32_t i = 0; i < 3U; i++) {
                arc.axes[i] = (struct axis){0, 0, 0, 0, 0, 0};
            }
        }
        n = number();
        if (arc.behind > BEHIND) {
            return TRUNCATED;
        }
        if (jump && !write_at(xyz[0], xyz[1], xyz[2], d->pen)) {
            return OUTSIDE;
        }
        for (; n != 0; n--) {
            step(xyz);
            if (arc.behind > BEHIND) {
                return TRUNCATED;
            }
            if (!write_at(xyz[0], xyz[1], xyz[2], d->pen)) {
                return OUTSIDE;
            }
        }
    }
    if (arc.behind > BEHIND) {
        return TRUNCATED;
    }
    return arc.behind == BEHIND ? OK : PADDING;
}

#endif
