/*
 * The receive ring and the segments in it (sections 3, 9.2 and 11).
 *
 * vxd_receive, which may be an interrupt routine, is the only writer of `head`, everything else the
 * only writer of `tail`. A 00 that ends no segment is not stored, so two 00 in a row are free to
 * mean that the segment before them was truncated by a loss. The credit counts neither of them:
 * hence the two bytes more.
 */
#include "internal.h"

#define SIZE ((uint32_t)VXD_RING + 3U)

static uint8_t ring[SIZE];
static volatile uint32_t head;     /* where the next byte goes */
static volatile uint32_t tail;     /* the oldest byte that is still needed */
static volatile bool ended;        /* the byte stored last ended a segment, or there is none */
static volatile bool lost;         /* bytes were lost behind the byte stored last */
static volatile bool loss_is_news; /* no OVERRUN has been sent for it */
static uint32_t scan;              /* the next byte in which to look for a 00 */
static uint32_t release;           /* where `tail` goes when the segment found has been taken */
static bool too_long;              /* the beginning of this segment has been thrown away */

static uint32_t distance(uint32_t from, uint32_t to)
{
    return to >= from ? to - from : to + SIZE - from;
}

static uint32_t following(uint32_t at)
{
    return at + 1U == SIZE ? 0U : at + 1U;
}

void ring_reset(void)
{
    VXD_LOCK();
    head = tail = scan = release = 0;
    ended = true;
    lost = loss_is_news = too_long = false;
    VXD_UNLOCK();
}

void vxd_receive(uint8_t byte)
{
    uint32_t at = head;

    if (byte == 0 && (ended || lost)) {
        return;
    }
    if (distance(tail, at) >= (uint32_t)VXD_RING) {
        if (!lost) {
            lost = true;
            loss_is_news = true;
        }
        return;
    }
    if (lost) {
        ring[at] = 0;
        at = following(at);
        ring[at] = 0;
        at = following(at);
        lost = false;
    }
    ring[at] = byte;
    ended = byte == 0;
    head = following(at);
}

bool ring_overrun(void)
{
    bool news = loss_is_news;

    loss_is_news = false;
    return news;
}

/* Undo COBS from `tail` to `end`, which is not included, and check the CRC. */
static bool decode_segment(uint32_t end, uint32_t *length)
{
    uint32_t at = tail;
    uint32_t size = 0;

    while (at != end) {
        uint32_t code = ring[at];
        uint32_t left = code - 1U;

        at = following(at);
        for (; left != 0; left--) {
            if (at == end || size == LONGEST_PACKET) {
                return false;
            }
            packet[size++] = ring[at];
            at = following(at);
        }
        if (code != 255U && at != end) {
            if (size == LONGEST_PACKET) {
                return false;
            }
            packet[size++] = 0;
        }
    }
    if (size < 7U) {
        return false;
    }
    *length = size - 4U;
    return crc32(packet, size - 4U) == get_u32(packet + size - 4U);
}

/* How many 00 follow a 00, which its segment ended by itself or through a loss. */
static uint32_t zeros_behind(uint32_t at, uint32_t until)
{
    uint32_t count = 0;

    for (at = following(at); at != until && ring[at] == 0; at = following(at)) {
        count++;
    }
    return count;
}

enum segment ring_segment(uint32_t *length)
{
    uint32_t until = head;
    uint32_t size;
    bool was_too_long = too_long;

    while (scan != until && ring[scan] != 0) {
        scan = following(scan);
        if (distance(tail, scan) > LONGEST_SEGMENT) {
            too_long = was_too_long = true;
            tail = scan;
        }
    }
    if (scan == until) {
        bool settled = false;

        VXD_LOCK();
        if (lost && head == until) {
            /* What is left of the segment is all that there will be. */
            lost = false;
            ended = true;
            settled = true;
        }
        VXD_UNLOCK();
        if (!settled) {
            return SEGMENT_NONE;
        }
        release = scan;
        too_long = false;
        return SEGMENT_DAMAGED;
    }
    size = distance(tail, scan);
    release = following(scan);
    if (zeros_behind(scan, until) == 1U) {
        release = following(release);
        too_long = false;
        return SEGMENT_DAMAGED;
    }
    if (was_too_long) {
        too_long = false;
        return SEGMENT_DAMAGED;
    }
    if (size < 8U) {
        return SEGMENT_SHORT;
    }
    return decode_segment(scan, length) ? SEGMENT_PACKET : SEGMENT_DAMAGED;
}

void ring_release(void)
{
    tail = scan = release;
}
