/* Declarations that the parts of the core share; makers of devices need none of them. */
#ifndef VXD_INTERNAL_H
#define VXD_INTERNAL_H

#include <stddef.h>

#include "voxel_device.h"

/* <string.h> need not be there where there is no C library. */
void *memcpy(void *restrict to, const void *restrict from, size_t count);

/* The longest packet, and the longest segment that holds one, without its 00 (section 3). */
#define LONGEST_PACKET ((uint32_t)VXD_MAX_PAYLOAD + 7U)
#define LONGEST_SEGMENT (LONGEST_PACKET + LONGEST_PACKET / 254U + 1U)

_Static_assert(VXD_MAX_PAYLOAD >= 64 && VXD_MAX_PAYLOAD <= 65535, "max_payload: 64 to 65535");
_Static_assert(VXD_RING >= 64U + LONGEST_SEGMENT + 1U, "the ring holds a packet and 64 bytes");
_Static_assert(VXD_NX >= 1 && VXD_NX <= 65535, "nx: 1 to 65535");
_Static_assert(VXD_NY >= 1 && VXD_NY <= 65535, "ny: 1 to 65535");
_Static_assert(VXD_NZ >= 1 && VXD_NZ <= 65535, "nz: 1 to 65535");
_Static_assert(VXD_NX * 1.0 * VXD_NY * VXD_NZ <= 2147483647.0, "at most 2^31 - 1 voxels");
_Static_assert(VXD_FORMAT >= 1 && VXD_FORMAT <= 4, "an unknown pixel format");
_Static_assert(VXD_FORMAT == VXD_INDEX8 || !(VXD_DIFF || VXD_PALETTE),
               "DIFF and PALETTE need INDEX8");

#define WIDE (VXD_NX > 256 || VXD_NY > 256 || VXD_NZ > 256)
#define COORDINATE_BYTES (WIDE ? 2U : 1U)
#define XYZ_BYTES (3U * COORDINATE_BYTES)
#define PIXEL_BYTES (VXD_FORMAT <= VXD_INDEX8 ? 1U : (uint32_t)VXD_FORMAT - 1U)
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

/* The one packet buffer: what was received last, then the response to it. */
extern uint8_t packet[LONGEST_PACKET];

uint32_t crc32(const uint8_t *bytes, uint32_t count);
void put_u16(uint32_t at, uint32_t value);
void put_u32(uint32_t at, uint32_t value);
uint32_t get_u16(const uint8_t *bytes);
uint32_t get_u32(const uint8_t *bytes);
/* Send the first `length` bytes of `packet`, with their CRC. */
void send_packet(uint32_t length);

/* ---- Pages (pages.c) ---- */

extern uint32_t back_digest;

void write_voxel(uint32_t index, uint32_t value);
/* Write the pen to (x, y, z), or return false if that is not on the grid. */
bool write_at(uint32_t x, uint32_t y, uint32_t z, uint32_t pen);
#if VXD_PALETTE
void write_color(uint8_t entry, uint32_t color);
#endif
#if VXD_READ
/* Encode voxels from `start` into `packet` at `at`; return where it ended, and how many. */
uint32_t encode_page(bool back, uint32_t start, uint32_t *count, uint32_t at);
#endif

/* ---- Ops (ops.c, shapes.c, range_coded_chains.c) ---- */

struct decoder {
    const uint8_t *at;  /* the next byte */
    const uint8_t *end; /* behind the payload */
    uint32_t cursor;
    uint32_t pen;
};

/* Apply the ops of a payload; `offset` becomes that of the op which is refused. */
enum code apply_ops(const uint8_t *payload, uint32_t length, uint32_t *offset);
uint32_t get_pixel(const uint8_t *bytes);
uint32_t bytes_left(const struct decoder *d);
void get_xyz(struct decoder *d, uint32_t xyz[3]);
void cursor_xyz(const struct decoder *d, uint32_t xyz[3]);
bool on_grid(const uint32_t xyz[3]);
uint32_t index_of(const uint32_t xyz[3]);
enum code draw_line(struct decoder *d);
enum code draw_box(struct decoder *d);
enum code draw_dots(struct decoder *d);
enum code draw_brick(struct decoder *d, uint32_t level);
enum code draw_arc(struct decoder *d);

#endif
