/*
 * The receive ring and the segments in it (sections 3, 9.2 and 11).
 *
 * vxd_receive, which may be an interrupt routine, is the only writer of `head`, everything else the
 * only writer of `tail`. A 00 that ends no segment is not stored, so two 00 in a row are free to
 * mean that the segment before them was truncated by a loss. The credit counts neither of them:
 * hence the two bytes more.
 */
#include "internal.h"

/* Two bytes more than the credit, rounded up to a power of two, so that indices may run freely. */
#define FILLED(n) ((n) | (n) >> 1 | (n) >> 2 | (n) >> 3 | (n) >> 4)
#define MASK (FILLED((uint32_t)VXD_RING + 1U) | FILLED(((uint32_t)VXD_RING + 1U) >> 5) | \
              FILLED(((uint32_t)VXD_RING + 1U) >> 10) | FILLED(((uint32_t)VXD_RING + 1U) >> 15) | \
              FILLED(((uint32_t)VXD_RING + 1U) >> 20) | FILLED(((uint32_t)VXD_RING + 1U) >> 25))

static struct {
    volatile uint32_t head;     /* where the next byte goes, modulo the ring's size */
    volatile uint32_t tail;     /* the oldest byte that is still needed */
    uint32_t scan;              /* the next byte in which to look for a 00 */
    uint32_t release;           /* where `tail` goes when the segment found has been taken */
    volatile bool ended;        /* the byte stored last ended a segment, or there is none */
    volatile bool lost;         /* bytes were lost behind the byte stored last */
    volatile bool loss_is_news; /* no OVERRUN has been sent for it */
    bool too_long;              /* the beginning of this segment has been thrown away */
    uint8_t bytes[MASK + 1U];
} ring;

void ring_reset(void)
{
    VXD_LOCK();
    ring.head = ring.tail = ring.scan = ring.release = 0;
    ring.ended = true;
    ring.lost = ring.loss_is_news = ring.too_long = false;
    VXD_UNLOCK();
}

void vxd_receive(uint8_t byte)
{
    uint32_t at = ring.head;

    if (byte == 0 && (ring.ended || ring.lost)) {
        return;
    }
    if (at - ring.tail >= (uint32_t)VXD_RING) {
        if (!ring.lost) {
            ring.lost = true;
            ring.loss_is_news = true;
        }
        return;
    }
    if (ring.lost) {
        ring.bytes[at++ & MASK] = 0;
        ring.bytes[at++ & MASK] = 0;
        ring.lost = false;
    }
    ring.bytes[at & MASK] = byte;
    ring.ended = byte == 0;
    ring.head = at + 1U;
}

bool ring_overrun(void)
{
    bool news = ring.loss_is_news;

    ring.loss_is_news = false;
    return news;
}

/* Undo COBS from `at` to `end`, which is not included, and check the CRC. */
static bool decode_segment(uint32_t at, uint32_t end, uint32_t *length)
{
    uint32_t size = 0;
    uint32_t left = 0;    /* bytes of the group that are still to come */
    bool implied = false; /* a 00 stands before the next group */

    for (; at != end; at++) {
        uint8_t byte = ring.bytes[at & MASK];

        if (left == 0) {
            const bool zero = implied;

            left = byte - 1U;
            implied = byte != 255U;
            if (!zero) {
                continue;
            }
            byte = 0;
        } else {
            left--;
        }
        if (size == LONGEST_PACKET) {
            return false;
        }
        packet[size++] = byte;
    }
    *length = size - 4U;
    return left == 0 && size >= 7U && crc32(packet, size - 4U) == get_u32(packet + size - 4U);
}

enum segment ring_segment(uint32_t *length)
{
    const uint32_t until = ring.head;
    uint32_t start = ring.tail;
    uint32_t scan = ring.scan;
    uint32_t zeros = 0;
    bool damaged;

    for (; scan != until && ring.bytes[scan & MASK] != 0; scan++) {
        if (scan - start == LONGEST_SEGMENT) {
            ring.too_long = true;
            ring.tail = start = scan;
        }
    }
    ring.scan = scan;
    damaged = ring.too_long;
    if (scan == until) {
        bool lost;

        VXD_LOCK();
        lost = ring.lost && ring.head == until;
        if (lost) {
            /* What is left of the segment is all that there will be. */
            ring.lost = false;
            ring.ended = true;
        }
        VXD_UNLOCK();
        if (!lost) {
            return SEGMENT_NONE;
        }
        damaged = true;
    }
    /* One 00 ends the segment. Two: a loss has truncated it. Three: a loss follows behind it. */
    while (scan + zeros != until && ring.bytes[(scan + zeros) & MASK] == 0) {
        zeros++;
    }
    ring.release = scan + (zeros == 2U ? 2U : zeros != 0);
    if (damaged || zeros == 2U) {
        ring.too_long = false;
        return SEGMENT_DAMAGED;
    }
    if (scan - start < 8U) {
        return SEGMENT_SHORT;
    }
    return decode_segment(start, scan, length) ? SEGMENT_PACKET : SEGMENT_DAMAGED;
}

void ring_release(void)
{
    ring.tail = ring.scan = ring.release;
}
