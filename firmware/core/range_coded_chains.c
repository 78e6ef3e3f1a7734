/* Range-coded chains: the decoder of the ops ARC and ARC2 (sections 7.7 and 7.10). */
#include "internal.h"

#if VXD_CHAINS

#define MAX_RUN 255U
#define MAX_K 15U
#define MAX_DELTA 30U
#define MORTON (VXD_NX <= 1024 && VXD_NY <= 1024 && VXD_NZ <= 1024)

enum { MORE = 0, JUMP = 1, INK = 2, NUMBER = 3, LONE = 18, TURN = 26, MAIN = 42, HISTORY = 74,
       RUNS = 138, NEAR = 266, FADE = 267, DELTA = 268 };

/* What one axis remembers of the steps before. */
struct axis {
    uint8_t last;
    uint8_t run;
    uint8_t prev;
    uint8_t prev2;
    uint8_t past;
    int8_t way;
};

static struct axis axes[3];

/* Decode a number whose length is in unary, by models from `model` on, at most `most`. */
static uint32_t number(uint32_t model, uint32_t most)
{
    uint32_t k = 0;

    while (k < most && bit_of(model + k)) {
        k++;
    }
    return ((uint32_t)1 << k) - 1U + plain(k);
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
        if (streak(&axes[i]) > streak(&axes[m])) {
            m = i;
        }
    }
    b = m == 2U ? 0 : m + 1U;
    c = b == 2U ? 0 : b + 1U;
    {
        uint32_t longer = streak(&axes[b]);

        if (streak(&axes[c]) > longer) {
            longer = streak(&axes[c]);
        }
        moved[m] = bit_of(MAIN + 8U * least(streak(&axes[m]), 3U) + least(longer, 7U));
    }
    if (moved[m]) {
        turn_and_go(&axes[m], &xyz[m]);
        moved[b] = moves_beside(&axes[b]);
    } else {
        moved[b] = bit_of(LONE + least(streak(&axes[b]), 7U));
    }
    if (moved[b]) {
        turn_and_go(&axes[b], &xyz[b]);
    }
    if (moved[m]) {
        moved[c] = moves_beside(&axes[c]);
    } else {
        moved[c] = moved[b] ? bit_of(LONE + least(streak(&axes[c]), 7U)) : 1U;
    }
    if (moved[c]) {
        turn_and_go(&axes[c], &xyz[c]);
    }
    for (uint32_t i = 0; i < 3U; i++) {
        record(&axes[i], moved[i]);
    }
}

#if VXD_ARC2
static uint32_t morton_of(const uint32_t xyz[3])
{
    uint32_t morton = 0;

    for (uint32_t bit = 0; bit < 30U; bit++) {
        morton |= (xyz[bit % 3U] >> bit / 3U & 1U) << bit;
    }
    return morton;
}

static void voxel_of(uint32_t morton, uint32_t xyz[3])
{
    xyz[0] = xyz[1] = xyz[2] = 0;
    for (uint32_t bit = 0; bit < 30U; bit++) {
        xyz[bit % 3U] |= (morton >> bit & 1U) << bit / 3U;
    }
}
#endif

static void plain_start(uint32_t xyz[3])
{
    xyz[0] = plain(bits_of(VXD_NX - 1U));
    xyz[1] = plain(bits_of(VXD_NY - 1U));
    xyz[2] = plain(bits_of(VXD_NZ - 1U));
}

#if VXD_ARC2
/* Decode the start of a piece of ARC2, whose `morton` is that of the start before. */
static enum code near_start(bool first, uint32_t *morton, uint32_t xyz[3])
{
    if (!MORTON || first || !bit_of(NEAR)) {
        plain_start(xyz);
        *morton = morton_of(xyz);
        return OK;
    }
    *morton += number(DELTA, MAX_DELTA);
    if (*morton >> 30) {
        return OUTSIDE;
    }
    voxel_of(*morton, xyz);
    return OK;
}

#if VXD_FADES
static enum code arc_fade(struct decoder *d)
{
    static uint8_t colors[16U * PEN_COLOR_BYTES];
    const uint32_t k = plain(4) + 1U;
    const uint32_t last = number(NUMBER, MAX_K);
    const uint32_t place = number(NUMBER, MAX_K);

    if (place > last) {
        return COUNT;
    }
    for (uint32_t i = 0; i < PEN_COLOR_BYTES * k; i++) {
        colors[i] = (uint8_t)plain(8);
    }
    begin_fade(d, colors, k, last + 1U, place);
    return OK;
}
#endif
#endif

/* Decode the pen of a piece. */
static enum code arc_pen(struct decoder *d, bool second)
{
#if VXD_ARC2 && VXD_FADES
    if (second && bit_of(FADE)) {
        return arc_fade(d);
    }
#else
    (void)second;
#endif
    d->pen = plain(VXD_FORMAT == VXD_MONO1 ? 1U : 8U * PIXEL_BYTES);
    end_fade(d);
    return OK;
}

/* Write the pen to a voxel of a piece: ARC2 counts it in a fade, ARC does not. */
static bool write_piece(struct decoder *d, const uint32_t xyz[3], bool second)
{
    if (!on_grid(xyz)) {
        return false;
    }
    if (second) {
        write_next(d, index_of(xyz));
    } else {
        write_voxel(index_of(xyz), d->pen);
    }
    return true;
}

enum code draw_arc(struct decoder *d, bool second)
{
    static const uint8_t shifts[7] = {1, 1, 2, 2, 3, 3, 4};
    uint32_t xyz[3] = {0, 0, 0};
    bool first = true;
#if VXD_ARC2
    uint32_t morton = 0;
#endif

    begin_bits(d, RANGE_MODELS_OF_CHAINS, shifts);
    while (bit_of(MORE)) {
        const bool jump = first || bit_of(JUMP);
        enum code code = OK;
        uint32_t n;

        if (bit_of(INK)) {
            code = arc_pen(d, second);
        }
        if (code == OK && jump) {
#if VXD_ARC2
            if (second) {
                code = near_start(first, &morton, xyz);
            } else
#endif
            {
                plain_start(xyz);
            }
            memset(axes, 0, sizeof axes);
        }
        first = false;
        if (bits_truncated()) {
            return TRUNCATED;
        }
        if (code != OK) {
            return code;
        }
        n = number(NUMBER, MAX_K);
        if (bits_truncated()) {
            return TRUNCATED;
        }
        if (jump && !write_piece(d, xyz, second)) {
            return OUTSIDE;
        }
        for (; n != 0; n--) {
            step(xyz);
            if (bits_truncated()) {
                return TRUNCATED;
            }
            if (!write_piece(d, xyz, second)) {
                return OUTSIDE;
            }
        }
    }
    return end_bits();
}

#endif
