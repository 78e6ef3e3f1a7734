/* Sessions, frames and responses: what a device does with each packet (sections 5, 6, 9 to 13). */
#include "internal.h"

enum { DATA = 1, HELLO = 3, STATUS = 4, READ = 5, ACK = 8, INFO = 9, PAGE = 10, ERROR = 11 };
enum { CLEAR = 1, COMMIT = 4 };                /* flags of DATA */
enum { SHOWN = 1, PENDING = 2, ASKED = 4 };    /* flags of ACK */
enum { BACK = 1 };                             /* flag of READ and PAGE */
enum state { EMPTY, FILLING, WHOLE };          /* of the back page; WHOLE waits for its tick */

/* One structure, so that a small processor needs one address for all of it. */
static struct {
    const struct vxd_identity *self;
    uint32_t received; /* bit i: the packet with the number next + 1 + i */
    uint32_t front_digest;
    uint16_t session; /* 0: none is open */
    uint16_t damaged;
    uint8_t next_number;
    uint8_t last;
    uint8_t newest; /* frame id of section 6: f */
    uint8_t shown_id;
    uint8_t frame_clear; /* the frame's flag CLEAR */
    uint8_t commit;      /* the lowest number with COMMIT, if `committed` */
    bool committed;
    bool shown;
    bool waiting; /* the oldest segment waits for the tick */
    uint8_t state; /* enum state */
} me;

void vxd_start(const struct vxd_identity *identity)
{
    me.self = identity;
    me.session = me.damaged = 0;
    me.front_digest = back_digest = 0;
    me.shown = me.waiting = false;
    me.shown_id = 0;
    me.state = EMPTY;
    ring_reset();
    vxd_clear();
    vxd_show();
    vxd_clear();
}

void vxd_disconnect(void)
{
    me.session = 0;
    me.state = EMPTY;
    me.shown = me.waiting = false;
    ring_reset();
}

static void put_header(uint32_t type, uint32_t flags, uint32_t seq, uint32_t frame)
{
    packet[0] = (uint8_t)(type << 4 | flags);
    packet[1] = (uint8_t)seq;
    packet[2] = (uint8_t)frame;
}

static uint32_t frame_on_display(void)
{
    return me.shown ? me.shown_id : 0;
}

static void send_ack(uint32_t asked, uint32_t named)
{
    put_header(ACK, (me.shown ? SHOWN : 0U) | (me.state == WHOLE ? PENDING : 0U) | asked, me.next_number,
               frame_on_display());
    packet[3] = (uint8_t)named;
    put_u16(4, me.session);
    put_u16(6, me.self->boot);
    put_u32(8, me.received);
    put_u32(12, VXD_RING);
    put_u32(16, VXD_DIGEST ? me.front_digest : 0);
    put_u16(20, me.damaged);
    send_packet(22);
}

static void send_error(enum code code, uint32_t offset, uint32_t seq, uint32_t frame)
{
    put_header(ERROR, 0, seq, frame);
    packet[3] = (uint8_t)code;
    put_u16(4, me.session);
    put_u16(6, offset);
    send_packet(8);
}

static uint32_t put_string(uint32_t at, const char *text)
{
    uint32_t length = at;

    for (at++; *text != '\0' && at < (uint32_t)VXD_MAX_PAYLOAD + 1U && at - length < 256U; at++) {
        packet[at] = (uint8_t)*text++;
    }
    packet[length] = (uint8_t)(at - length - 1U);
    return at;
}

static void send_info(uint32_t of_session)
{
    /* The fields of section 5 that the configuration gives; pages: 2. */
    static const uint8_t fields[32] = {
        INFO << 4, 0, 0, 1, 0, 0, 0, 0, VXD_SLABS | VXD_FADE | VXD_ARC2, VXD_FORMAT,
        VXD_NX & 255, VXD_NX >> 8, VXD_NY & 255, VXD_NY >> 8, VXD_NZ & 255, VXD_NZ >> 8, 2, 0,
        VXD_MAX_PAYLOAD & 255, VXD_MAX_PAYLOAD >> 8,
        VXD_RING & 255, VXD_RING >> 8 & 255, (uint32_t)VXD_RING >> 16 & 255, (uint32_t)VXD_RING >> 24,
        0, 0, 0, 0,
        VXD_LINE | VXD_BOX << 1 | VXD_DOTS << 2 | VXD_OCT << 3 | VXD_DIFF << 4 | VXD_ARC << 5 |
            VXD_PALETTE << 6 | VXD_READ << 7,
        VXD_DIGEST | VXD_SLABS << 1 | VXD_FADE << 2 | VXD_ARC2 << 3, 0, 0};
    uint32_t at;

    memcpy(packet, fields, sizeof fields);
    put_u16(4, of_session);
    put_u16(6, me.self->boot);
    put_u32(24, me.self->refresh);
    at = put_string(32, me.self->name);
    at = put_string(at, me.self->firmware);
    send_packet(put_string(at, me.self->serial));
}

static void swap(void)
{
    vxd_show();
    me.front_digest = back_digest;
    me.shown = true;
    me.shown_id = me.newest;
    me.state = EMPTY;
    me.waiting = false;
}

void vxd_tick(void)
{
    if (me.state == WHOLE) {
        swap();
        send_ack(0, me.last);
    }
}

static enum code take_hello(uint32_t length, uint32_t *offset)
{
    uint32_t asked = get_u16(packet + 4);

    if (length < 8U) {
        return LENGTH;
    }
    if (asked == 0) {
        *offset = 4;
        return FIELD;
    }
    if (packet[3] == 1U) {
        me.session = (uint16_t)asked;
        me.received = 0;
        me.next_number = 0;
        me.last = me.newest = 255;
        me.shown = false;
        me.state = EMPTY;
    }
    send_info(asked);
    return OK;
}

#if VXD_READ
static enum code take_read(uint32_t length, uint32_t flags, uint32_t *offset)
{
    uint32_t start = get_u32(packet + 4);
    uint32_t count = get_u32(packet + 8);

    if (length != 12U) {
        return LENGTH;
    }
    if (flags & ~(uint32_t)BACK) {
        return FIELD;
    }
    *offset = 2;
    if (packet[2] != 0) {
        return FIELD;
    }
    *offset = 3;
    if (packet[3] != 0) {
        return FIELD;
    }
    *offset = 8;
    if (count == 0) {
        return FIELD;
    }
    *offset = 4;
    if (start >= VXD_VOXELS || count > VXD_VOXELS - start) {
        return OUTSIDE;
    }
    length = encode_page(flags == BACK, start, &count, 12);
    put_header(PAGE, flags, packet[1], frame_on_display());
    put_u32(8, count);
    send_packet(length);
    return OK;
}
#endif

static enum code take_status(uint32_t length, uint32_t flags, uint32_t *offset)
{
    if (length != 3U) {
        return LENGTH;
    }
    if (flags != 0) {
        return FIELD;
    }
    *offset = 2;
    if (packet[2] != 0) {
        return FIELD;
    }
    send_ack(ASKED, packet[1]);
    return OK;
}

/* Note that the packet at the distance d from the next number has been me.received. */
static void note_received(uint32_t d)
{
    if (d != 0) {
        me.received |= (uint32_t)1 << (d - 1U);
        return;
    }
    me.next_number++;
    while (me.received & 1U) {
        me.received >>= 1;
        me.next_number++;
    }
    me.received >>= 1;
}

static void begin_frame(uint32_t flags)
{
    me.newest = packet[2];
    me.committed = false;
    me.frame_clear = flags & CLEAR;
    me.state = FILLING;
    if (flags & CLEAR) {
        vxd_clear();
        back_digest = 0;
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

static enum code take_data(uint32_t length, uint32_t flags, uint32_t *offset)
{
    const uint32_t number = packet[1];
    const uint32_t ahead = numbers_ahead();
    const bool duplicate = is_duplicate();
    enum code code;

    if (flags & ~(uint32_t)(CLEAR | COMMIT)) {
        return FIELD;
    }
    *offset = 1;
    if (!duplicate && ahead >= 32U) {
        return SEQUENCE;
    }
    me.last = packet[1];
    if (duplicate) {
        send_ack(0, me.last);
        return OK;
    }
    *offset = 2;
    if (packet[2] == me.newest) {
        if (me.state != FILLING ||
            (me.committed && ((number - me.commit) & 255U) < 128U)) {
            return FRAME;
        }
        if ((flags & CLEAR) != me.frame_clear) {
            *offset = 0;
            return FRAME;
        }
    } else {
        const bool following = packet[2] == ((me.newest + 1U) & 255U);

        if (ahead != 0 && (me.state == FILLING || !following)) {
            send_ack(0, me.last); /* what is missing may belong to the frame before */
            return OK;
        }
        if (!following) {
            return FRAME;
        }
        begin_frame(flags);
    }
    code = apply_ops(packet + 3, length - 3U, offset);
    if (code != OK) {
        *offset += 3U;
        return code;
    }
    if (flags & COMMIT) {
        /* Of two, the lower: the one above has been refused. */
        me.committed = true;
        me.commit = (uint8_t)number;
    }
    note_received(ahead);
    if (me.committed && ((me.next_number - me.commit - 1U) & 255U) < 128U) {
        me.state = WHOLE;
        if (me.self->refresh == 0) {
            swap();
        }
    }
    send_ack(0, me.last);
    return OK;
}

static void take_packet(uint32_t length)
{
    const uint32_t type = packet[0] >> 4;
    const uint32_t flags = packet[0] & 15U;
    const uint32_t seq = packet[1];
    const uint32_t frame = packet[2];
    uint32_t offset = 0;
    enum code code = TYPE;

    if (me.session == 0 && type != HELLO) {
        code = NO_SESSION;
    } else if (type == DATA) {
        code = take_data(length, flags, &offset);
    } else if (type == HELLO) {
        code = take_hello(length, &offset);
    } else if (type == STATUS) {
        code = take_status(length, flags, &offset);
#if VXD_READ
    } else if (type == READ) {
        code = take_read(length, flags, &offset);
#endif
    }
    if (code != OK) {
        send_error(code, offset, seq, frame);
        if (type == DATA && me.session != 0) {
            me.session = 0;
            me.state = EMPTY;
            me.shown = false;
        }
    }
}

static void note_damage(void)
{
    me.damaged++;
    if (me.session != 0) {
        send_ack(0, me.last);
    }
}

bool vxd_poll(void)
{
    uint32_t length;
    enum segment segment;

    if (ring_overrun()) {
        send_error(OVERRUN, 0, 0, 0);
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
