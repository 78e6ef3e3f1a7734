/*
 * The receive ring and the segments in it (sections 3, 9.2 and 11).
 *
 * vxd_receive, which may be an interrupt routine, is the only writer of `head` and `start` (but for
 * segments that are too long, of which the reader throws the beginning away); the reader never
 * looks behind `start`, so a segment that is not whole can be given up at any time. A 00 that ends
 * nothing is not stored: an empty segment in the ring stands for one that was too long.
 */
#include "internal.h"

/* The credit, rounded up to a power of two, so that indices may run freely. */
#define FILLED(n) ((n) | (n) >> 1 | (n) >> 2 | (n) >> 3 | (n) >> 4)
#define LAST ((uint32_t)VXD_RING - 1U)
#define MASK (FILLED(LAST) | FILLED(LAST >> 5) | FILLED(LAST >> 10) | FILLED(LAST >> 15) | \
              FILLED(LAST >> 20) | FILLED(LAST >> 25))

enum { NOT, TOO_LONG, TRUNCATED_BY_LOSS }; /* why the rest of a segment is skipped */

static struct {
    volatile uint32_t head;  /* where the next byte goes, modulo the ring's size */
    volatile uint32_t start; /* the first byte of the segment that is not whole yet */
    volatile uint32_t tail;  /* the oldest byte that is still needed */
    uint32_t release;        /* where `tail` goes when the segment found has been taken */
    volatile uint8_t skipping; /* one of the above */
    volatile bool lost;      /* bytes are being lost until the device reads again */
    volatile bool news;      /* no OVERRUN has been sent for it */
    uint8_t bytes[MASK + 1U];
} ring;

void ring_reset(void)
{
    VXD_LOCK();
    ring.head = ring.start = ring.tail = 0;
    ring.skipping = NOT;
    ring.lost = ring.news = false;
    VXD_UNLOCK();
}

void vxd_receive(uint8_t byte)
{
    if (!ring.lost) {
        if (ring.skipping != NOT) {
            if (byte != 0) {
                return;
            }
            if (ring.skipping == TRUNCATED_BY_LOSS) {
                ring.skipping = NOT;
                return;
            }
        } else if (byte == 0 && ring.head == ring.start) {
            return;
        }
        if (ring.head - ring.tail < (uint32_t)VXD_RING) {
            ring.bytes[ring.head & MASK] = byte;
            ring.head++;
            if (byte == 0) {
                ring.skipping = NOT;
                ring.start = ring.head;
            }
            return;
        }
        ring.lost = true;
        ring.news = true;
        ring.head = ring.start;
    }
    ring.skipping = byte != 0 ? TRUNCATED_BY_LOSS : NOT;
}

bool ring_overrun(void)
{
    if (!ring.news) {
        return false;
    }
    ring.news = false; /* not unless it is set: a loss may happen right here */
    return true;
}

/* Undo COBS from the oldest byte to the 00 behind it, and check the CRC. */
static enum segment decode_segment(uint32_t *length)
{
    uint32_t at = ring.tail;
    uint32_t size = 0;
    uint32_t left = 0;    /* bytes of the group that are still to come */
    bool implied = false; /* a 00 stands before the next group */
    uint8_t byte;

    while ((byte = ring.bytes[at++ & MASK]) != 0) {
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
        if (size < LONGEST_PACKET) {
            packet[size] = byte;
        }
        size++;
    }
    ring.release = at;
    at -= ring.tail;
    if (at >= 2U && at <= 8U) { /* below 8 bytes and a 00, but not a segment that was too long */
        return SEGMENT_SHORT;
    }
    size -= 4U;
    *length = size;
    return left == 0 && size - 3U <= LONGEST_PACKET - 7U && crc32(packet, size) == get_u32(packet + size)
               ? SEGMENT_PACKET
               : SEGMENT_DAMAGED;
}

enum segment ring_segment(uint32_t *length)
{
    const uint32_t tail = ring.tail;

    if (tail != ring.start) {
        return decode_segment(length);
    }
    VXD_LOCK();
    if (ring.start == tail && ring.head - tail > LONGEST_SEGMENT) {
        ring.skipping = TOO_LONG;
        ring.head = tail;
    }
    ring.lost = false;
    VXD_UNLOCK();
    return SEGMENT_NONE;
}

void ring_release(void)
{
    ring.tail = ring.release;
    ring.lost = false;
}
