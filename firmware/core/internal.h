/* Declarations that the parts of the core share; makers of devices need none of them. */
#ifndef VXD_INTERNAL_H
#define VXD_INTERNAL_H

#include <stddef.h>

#include "voxel_device.h"

/* <string.h> need not be there where there is no C library. */
void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memset(void *to, int byte, size_t count);

/* The longest packet, and the longest segment that holds one, without its 00 (section 3). */
#define LONGEST_PACKET ((uint32_t)VXD_MAX_PAYLOAD + 7U)
#define LONGEST_SEGMENT (LONGEST_PACKET + LONGEST_PACKET / 254U + 1U)

_Static_assert(VXD_MAX_PAYLOAD >= 64 && VXD_MAX_PAYLOAD <= 65535, "max_payload: 64 to 65535");
_Static_assert(VXD_RING >= 64U + LONGEST_SEGMENT + 1U, "the ring holds a packet and 64 bytes");
_Static_assert(VXD_NX >= 1 && VXD_NX <= 65535, "nx: 1 to 65535");
_Static_assert(VXD_NY >= 1 && VXD_NY <= 65535, "ny: 1 to 65535");
_Static_assert(VXD_NZ >= 1 && VXD_NZ <= 65535, "nz: 1 to 65535");
_Static_assert((uint64_t)VXD_NX * VXD_NY * VXD_NZ <= 2147483647U, "at most 2^31 - 1 voxels");
_Static_assert(VXD_FORMAT >= 1 && VXD_FORMAT <= 4, "an unknown pixel format");
_Static_assert(VXD_FORMAT == VXD_INDEX8 || !VXD_DIFF, "DIFF needs INDEX8");
_Static_assert(VXD_FORMAT == VXD_INDEX8 || !VXD_PALETTE, "PALETTE needs INDEX8");
_Static_assert(VXD_FORMAT != VXD_MONO1 || !VXD_FADE, "FADE does not go with MONO1");

/* Whether the pen may be a fade: ARC2 has fades of its own. */
#define VXD_FADES (VXD_FADE || (VXD_ARC2 && VXD_FORMAT != VXD_MONO1))
#define VXD_CHAINS (VXD_ARC || VXD_ARC2)
#define VXD_RANGE_CODED (VXD_CHAINS || VXD_SLABS)

/* A device that has none of the features of version 1.1 is one of version 1.0. */
#if VXD_SLABS || VXD_FADE || VXD_ARC2 || VXD_HOLD
#define MINOR 1U
#else
#define MINOR 0U
#endif

#define WIDE (VXD_NX > 256 || VXD_NY > 256 || VXD_NZ > 256)
#define COORDINATE_BYTES (WIDE ? 2U : 1U)
#define XYZ_BYTES (3U * COORDINATE_BYTES)
#define PIXEL_BYTES (VXD_FORMAT <= VXD_INDEX8 ? 1U : (uint32_t)VXD_FORMAT - 1U)
#define PEN_COLOR_BYTES (VXD_FORMAT == VXD_INDEX8 ? 1U : 3U) /* of a colour of a fade */
#define FULL_PIXEL (VXD_FORMAT == VXD_MONO1 ? 1U : 0xFFFFFFFFU >> (32U - 8U * PIXEL_BYTES))

/* Section 11. */
enum code {
    OK = 0,
    NO_SESSION = 1,
    TYPE = 2,
    LENGTH = 3,
    FIELD = 4,
    SEQUENCE = 5,
    FRAME = 6,
    OP = 7,
    COUNT = 8,
    TRUNCATED = 9,
    PADDING = 10,
    PIXEL = 11,
    OUTSIDE = 12,
    OVERRUN = 13
};

/* A refusal: a code, and an offset in the packet, which is 0 with a code alone. */
#define REFUSED(code, offset) ((code) | (offset) << 8)

/* ---- The receive ring (ring.c) ---- */

enum segment { SEGMENT_NONE, SEGMENT_PACKET, SEGMENT_DAMAGED, SEGMENT_SHORT };

void ring_reset(void);
/* Whether bytes were lost since the last call. */
bool ring_overrun(void);
/* Find the next segment; decode it into `packet`, with its CRC, whose length comes without it. */
enum segment ring_segment(uint32_t *length);
/* Free the room of the segment that was found last. */
void ring_release(void);

/* ---- Packets (packets.c) ---- */

/* The one packet buffer: what was received last, then the response to it, with a 00 behind it. */
extern uint8_t packet[LONGEST_PACKET + 1U];

uint32_t crc32(const uint8_t *bytes, uint32_t count);
void put_u16(uint32_t at, uint32_t value);
void put_u32(uint32_t at, uint32_t value);
uint32_t get_u16(const uint8_t *bytes);
uint32_t get_u32(const uint8_t *bytes);
/* Send the first `length` bytes of `packet`, with their CRC. */
void send_packet(uint32_t length);

/* ---- Pages (pages.c) ---- */

extern uint32_t back_digest;

#if VXD_DIGEST
void write_voxel(uint32_t index, uint32_t value);
#else
#define write_voxel(index, value) vxd_put(index, value)
#endif
/* Write the pen to (x, y, z), or return false if that is not on the grid. */
bool write_at(uint32_t x, uint32_t y, uint32_t z, uint32_t pen);
#if VXD_PALETTE
void write_color(uint8_t entry, uint32_t color);
#endif
#if VXD_READ
/* Encode voxels from `start` into `packet` at `at`; return where it ended, and how many. */
uint32_t encode_page(bool back, uint32_t start, uint32_t *count, uint32_t at);
#endif

/* ---- Frames (session.c) ---- */

#if VXD_HOLD
/* HOLD: let the frame before stay for some ticks; return OP if there are no ticks. */
enum code hold_frame(uint8_t ticks);
#endif

/* ---- Ops (ops.c, chains.c, runs.c, shapes.c, fades.c, range_coded_*.c) ---- */

struct decoder {
    const uint8_t *at;  /* the next byte */
    const uint8_t *end; /* behind the payload */
    uint32_t cursor;
    uint32_t pen;
#if VXD_FADES
    uint32_t pen_before; /* of the place before */
    bool fading;         /* the pen is that of a place of a fade */
    bool joined;         /* the cursor is at the place before */
#endif
};

/* Apply the ops of the packet in the buffer; return OK, or what is refused, and where. */
uint32_t apply_ops(uint32_t length);
uint32_t get_pixel(const uint8_t *bytes);
uint32_t bytes_left(const struct decoder *d);
/* Decode a LEB128 (section 7.2): its shortest form, of at most 5 bytes. */
enum code get_leb128(struct decoder *d, uint32_t *value);
void get_xyz(struct decoder *d, uint32_t xyz[3]);
void cursor_xyz(const struct decoder *d, uint32_t xyz[3]);
bool on_grid(const uint32_t xyz[3]);
uint32_t index_of(const uint32_t xyz[3]);
/* STEP, or FROM, which begins with a place. */
enum code draw_chain(struct decoder *d, uint32_t octant, bool from);
/* SKIP, RUN, LIT or DIFF. */
enum code draw_run(struct decoder *d, uint32_t op);
enum code draw_line(struct decoder *d);
enum code draw_box(struct decoder *d);
enum code draw_dots(struct decoder *d);
enum code draw_brick(struct decoder *d, uint32_t level);
/* ARC, or the second kind of it, ARC2. */
enum code draw_arc(struct decoder *d, bool second);
enum code draw_slabs(struct decoder *d);
enum code set_fade(struct decoder *d);
enum code set_ramp(struct decoder *d);

#if VXD_FADES
/* Make the pen that of a place of a fade; the colours stay where they are. */
void begin_fade(struct decoder *d, const uint8_t *colors, uint32_t k, uint32_t n, uint32_t place);
/* Write the pen, and go on to the next place of a fade. */
void write_next(struct decoder *d, uint32_t index);
/* The same for the first voxel of STEP and LINE, which may have been written already. */
void write_first(struct decoder *d, uint32_t index);
#else
#define write_next(d, index) write_voxel(index, (d)->pen)
#define write_first(d, index) write_voxel(index, (d)->pen)
#endif

/* End a fade: the pen has been set. */
static inline void end_fade(struct decoder *d)
{
#if VXD_FADES
    d->fading = false;
#else
    (void)d;
#endif
}

/* Note whether the op that has set the cursor counts its voxels in a fade. */
static inline void join_fade(struct decoder *d, bool joined)
{
#if VXD_FADES
    d->joined = joined;
#else
    (void)d;
    (void)joined;
#endif
}

/* ---- The range decoder (range_decoder.c) ---- */

#define SLABS_MODELS 2434U
#define RANGE_MODELS_OF_CHAINS (VXD_ARC2 ? 298U : 266U)
#define RANGE_MODELS (VXD_SLABS ? SLABS_MODELS : RANGE_MODELS_OF_CHAINS)

/* Begin with the rest of the payload; `shifts` is how fast a model adapts, by bits seen. */
void begin_bits(struct decoder *d, uint32_t models, const uint8_t shifts[7]);
/* Whether more bytes were needed than there are. */
bool bits_truncated(void);
/* What the end of an op without a fault comes to. */
enum code end_bits(void);
uint32_t bit_of(uint32_t i);
uint32_t bit_of_two(uint32_t i, uint32_t j);
/* Decode a number of so many bits, without models. */
uint32_t plain(uint32_t count);
/* How many bits a number has. */
uint32_t bits_of(uint32_t number);

#endif
