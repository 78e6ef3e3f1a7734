/* Sessions, frames and responses: what a device does with each packet (sections 5, 6, 9 to 13). */
#include "internal.h"

enum { DATA = 1, HELLO = 3, STATUS = 4, READ = 5, ACK = 8, INFO = 9, PAGE = 10, ERROR = 11 };
enum { CLEAR = 1, COMMIT = 4 };                /* flags of DATA */
enum { SHOWN = 1, PENDING = 2, ASKED = 4 };    /* flags of ACK */
enum { BACK = 1 };                             /* flag of READ and PAGE */
enum { EMPTY = 0, FILLING = 1, WHOLE = PENDING }; /* the back page; WHOLE waits for its tick */

/* One structure, so that a small processor needs one address for all of it. */
static struct {
    const struct vxd_identity *self;
    uint32_t received; /* bit i: the packet with the number next + 1 + i */
    uint32_t front_digest;
    uint16_t session; /* 0: none is open */
    uint16_t damaged;
    uint8_t state;
    uint8_t shown;    /* the flag SHOWN, or 0 */
    uint8_t shown_id; /* 0 if none is shown */
    bool waiting;     /* the oldest segment waits for the tick */
    uint8_t next_number;
    uint8_t last;
    uint8_t newest;      /* frame id of section 6: f */
    uint8_t frame_clear; /* the frame's flag CLEAR */
    uint8_t commit;      /* the lowest number with COMMIT, if `committed` */
    bool committed;
#if VXD_HOLD
    uint8_t hold;  /* of the frame in the back page */
    uint8_t since; /* ticks since the last swap, at most 255 */
#endif
} me;

static void forget_frames(void)
{
    me.state = EMPTY;
    me.shown = 0;
    me.shown_id = 0;
}

void vxd_disconnect(void)
{
    forget_frames();
    me.session = 0;
    me.waiting = false;
    ring_reset();
}

void vxd_start(const struct vxd_identity *identity)
{
    vxd_disconnect();
    me.self = identity;
    me.damaged = 0;
    me.front_digest = back_digest = 0;
    vxd_clear();
    vxd_show();
    vxd_clear();
}

static void send_ack(uint32_t asked)
{
    packet[0] = (uint8_t)((uint32_t)ACK << 4 | me.shown | (me.state & PENDING) | asked);
    packet[1] = me.next_number;
    packet[2] = me.shown_id;
    packet[3] = me.last;
    put_u16(4, me.session);
    put_u16(6, me.self->boot);
    put_u32(8, me.received);
    put_u32(12, VXD_RING);
    put_u32(16, VXD_DIGEST ? me.front_digest : 0);
    put_u16(20, me.damaged);
    send_packet(22);
}

/* Refuse the packet in the buffer, whose number and frame the ERROR repeats. */
static void send_error(uint32_t refusal)
{
    packet[0] = ERROR << 4;
    packet[3] = (uint8_t)refusal;
    put_u16(4, me.session);
    put_u16(6, refusal >> 8);
    send_packet(8);
}

static uint32_t put_string(uint32_t at, const char *text)
{
    uint32_t count = 0;

    while (*text != '\0' && count < 255U && at + count < (uint32_t)VXD_MAX_PAYLOAD) {
        count++;
        packet[at + count] = (uint8_t)*text++;
    }
    packet[at] = (uint8_t)count;
    return at + count + 1U;
}

static void send_info(uint32_t of_session)
{
    /* The fields of section 5 that the configuration gives; pages: 2. */
    static const uint8_t fields[32] = {
        INFO << 4, 0, 0, 1, 0, 0, 0, 0, MINOR, VXD_FORMAT,
        VXD_NX & 255, VXD_NX >> 8, VXD_NY & 255, VXD_NY >> 8, VXD_NZ & 255, VXD_NZ >> 8, 2, 0,
        VXD_MAX_PAYLOAD & 255, VXD_MAX_PAYLOAD >> 8,
        VXD_RING & 255, VXD_RING >> 8 & 255, (uint32_t)VXD_RING >> 16 & 255, (uint32_t)VXD_RING >> 24,
        0, 0, 0, 0,
        VXD_LINE | VXD_BOX << 1 | VXD_DOTS << 2 | VXD_OCT << 3 | VXD_DIFF << 4 | VXD_ARC << 5 |
            VXD_PALETTE << 6 | VXD_READ << 7,
        VXD_DIGEST | VXD_SLABS << 1 | VXD_FADE << 2 | VXD_ARC2 << 3 | VXD_HOLD << 4, 0, 0};
    uint32_t at;

    memcpy(packet, fields, sizeof fields);
    put_u16(4, of_session);
    put_u16(6, me.self->boot);
    put_u32(24, me.self->refresh);
#if VXD_HOLD
    if (me.self->refresh == 0) {
        packet[29] = (uint8_t)(packet[29] & ~16U);
    }
#endif
    at = put_string(32, me.self->name);
    at = put_string(at, me.self->firmware);
    send_packet(put_string(at, me.self->serial));
}

#if VXD_HOLD
enum code hold_frame(uint8_t ticks)
{
    if (me.self->refresh == 0) {
        return OP;
    }
    if (me.hold < ticks) {
        me.hold = ticks;
    }
    return OK;
}
#endif

static void swap(void)
{
    vxd_show();
    me.front_digest = back_digest;
    me.shown = SHOWN;
    me.shown_id = me.newest;
    me.state = EMPTY;
    me.waiting = false;
#if VXD_HOLD
    me.since = 0;
#endif
}

/* Count a tick; return whether the frame before has been on display for long enough. */
static bool hold_is_over(void)
{
#if VXD_HOLD
    if (me.since < 255U) {
        me.since++;
    }
    return me.since >= me.hold;
#else
    return true;
#endif
}

void vxd_tick(void)
{
    if (hold_is_over() && me.state == WHOLE) {
        swap();
        send_ack(0);
    }
}

static uint32_t take_hello(uint32_t length)
{
    const uint32_t asked = get_u16(packet + 4);

    if (length < 8U) {
        return LENGTH;
    }
    if (asked == 0) {
        return REFUSED(FIELD, 4);
    }
    if (packet[3] == 1U) {
        forget_frames();
        me.session = (uint16_t)asked;
        me.received = 0;
        me.next_number = 0;
        me.last = me.newest = 255;
#if VXD_HOLD
        me.since = 255;
#endif
    }
    send_info(asked);
    return OK;
}

#if VXD_READ
static uint32_t take_read(uint32_t length, uint32_t flags)
{
    const uint32_t start = get_u32(packet + 4);
    uint32_t count = get_u32(packet + 8);

    if (length != 12U) {
        return LENGTH;
    }
    if (flags & ~(uint32_t)BACK) {
        return FIELD;
    }
    if (packet[2] != 0) {
        return REFUSED(FIELD, 2);
    }
    if (packet[3] != 0) {
        return REFUSED(FIELD, 3);
    }
    if (count == 0) {
        return REFUSED(FIELD, 8);
    }
    if (start >= VXD_VOXELS || count > VXD_VOXELS - start) {
        return REFUSED(OUTSIDE, 4);
    }
    length = encode_page(flags == BACK, start, &count, 12);
    packet[0] = (uint8_t)((uint32_t)PAGE << 4 | flags);
    packet[2] = me.shown_id;
    put_u32(8, count);
    send_packet(length);
    return OK;
}
#endif

static uint32_t take_status(uint32_t length, uint32_t flags)
{
    const uint8_t last = me.last;

    if (length != 3U) {
        return LENGTH;
    }
    if (flags != 0) {
        return FIELD;
    }
    if (packet[2] != 0) {
        return REFUSED(FIELD, 2);
    }
    me.last = packet[1];
    send_ack(ASKED);
    me.last = last;
    return OK;
}

/* Note that the packet at the distance d from the next number has been received. */
static void note_received(uint32_t d)
{
    if (d != 0) {
        me.received |= (uint32_t)1 << (d - 1U);
        return;
    }
    do {
        d = me.received & 1U;
        me.received >>= 1;
        me.next_number++;
    } while (d != 0);
}

static void begin_frame(uint32_t flags)
{
    me.newest = packet[2];
    me.committed = false;
    me.frame_clear = flags & CLEAR;
    me.state = FILLING;
#if VXD_HOLD
    me.hold = 0;
#endif
    back_digest = 0;
    if (flags & CLEAR) {
        vxd_clear();
    } else {
        vxd_keep();
        back_digest = me.front_digest;
    }
}

/* How far the number of a DATA packet is ahead of the next one, modulo 256. */
static uint32_t numbers_ahead(void)
{
    return (packet[1] - (uint32_t)me.next_number) & 255U;
}

static bool is_duplicate(void)
{
    const uint32_t ahead = numbers_ahead();

    return ahead >= 224U || (ahead >= 1U && ahead < 32U && me.received >> (ahead - 1U) & 1U);
}

/* Whether the packet waits for the tick: it is of a frame behind one that is whole. */
static bool must_wait(void)
{
    return me.state == WHOLE && packet[0] >> 4 == DATA && packet[2] != me.newest && !is_duplicate();
}

/* Whether a number is that of the frame's COMMIT or a higher one, as far as it is known. */
static bool is_behind_commit(uint32_t number)
{
    return me.committed && ((number - me.commit) & 255U) < 128U;
}

static uint32_t take_data(uint32_t length, uint32_t flags)
{
    const uint32_t number = packet[1];
    const uint32_t ahead = numbers_ahead();
    const bool duplicate = is_duplicate();

    if (flags & ~(uint32_t)(CLEAR | COMMIT)) {
        return FIELD;
    }
    if (!duplicate && ahead >= 32U) {
        return REFUSED(SEQUENCE, 1);
    }
    me.last = (uint8_t)number;
    if (!duplicate) {
        const uint32_t frames_ahead = (packet[2] - (uint32_t)me.newest) & 255U;
        uint32_t refusal;

        if (frames_ahead == 0) {
            if (me.state == FILLING && !is_behind_commit(number)) {
                if ((flags & CLEAR) != me.frame_clear) {
                    return FRAME;
                }
            } else {
                return REFUSED(FRAME, 2);
            }
        } else if (ahead != 0 && (me.state == FILLING || frames_ahead != 1U)) {
            send_ack(0); /* what is missing may belong to the frame before */
            return OK;
        } else if (frames_ahead != 1U) {
            return REFUSED(FRAME, 2);
        } else {
            begin_frame(flags);
        }
        refusal = apply_ops(length);
        if (refusal != OK) {
            return refusal;
        }
        if (flags & COMMIT) {
            /* Of two, the lower: the one above has been refused. */
            me.committed = true;
            me.commit = (uint8_t)number;
        }
        note_received(ahead);
        if (is_behind_commit(me.next_number - 1U)) {
            me.state = WHOLE;
            if (me.self->refresh == 0) {
                swap();
            }
        }
    }
    send_ack(0);
    return OK;
}

static void take_packet(uint32_t length)
{
    const uint32_t type = packet[0] >> 4;
    const uint32_t flags = packet[0] & 15U;
    uint32_t refusal = TYPE;

    if (type == HELLO) {
        refusal = take_hello(length);
    } else if (me.session == 0) {
        refusal = NO_SESSION;
    } else if (type == DATA) {
        refusal = take_data(length, flags);
    } else if (type == STATUS) {
        refusal = take_status(length, flags);
#if VXD_READ
    } else if (type == READ) {
        refusal = take_read(length, flags);
#endif
    }
    if (refusal != OK) {
        send_error(refusal);
        if (type == DATA) {
            me.session = 0;
            forget_frames();
        }
    }
}

static void note_damage(void)
{
    me.damaged++;
    if (me.session != 0) {
        send_ack(0);
    }
}

bool vxd_poll(void)
{
    uint32_t length;
    enum segment segment;

    if (ring_overrun()) {
        packet[1] = packet[2] = 0;
        send_error(OVERRUN);
        note_damage();
    }
    if (me.waiting) {
        return false;
    }
    segment = ring_segment(&length);
    if (segment == SEGMENT_NONE) {
        return false;
    }
    if (segment == SEGMENT_PACKET && must_wait()) {
        me.waiting = true; /* its bytes stay in the ring, from which it is read again */
        return false;
    }
    ring_release(); /* before the response grants the room anew */
    if (segment == SEGMENT_PACKET) {
        take_packet(length);
    } else if (segment == SEGMENT_DAMAGED) {
        note_damage();
    }
    return true;
}
