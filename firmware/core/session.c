/* Sessions, frames and responses: what a device does with each packet (sections 5, 6, 9 to 13). */
#include "internal.h"

enum { DATA = 1, HELLO = 3, STATUS = 4, READ = 5, ACK = 8, INFO = 9, PAGE = 10, ERROR = 11 };
enum { CLEAR = 1, COMMIT = 4 };                /* flags of DATA */
enum { SHOWN = 1, PENDING = 2, ASKED = 4 };    /* flags of ACK */
enum { BACK = 1 };                             /* flag of READ and PAGE */
enum state { EMPTY, FILLING, WHOLE };          /* of the back page; WHOLE waits for its tick */

static const struct vxd_identity *self;
static uint16_t session; /* 0: none is open */
static uint16_t damaged;
static uint32_t received; /* bit i: the packet with the number next + 1 + i */
static uint32_t front_digest;
static uint8_t next_number;
static uint8_t last;
static uint8_t newest;    /* frame id of section 6: f */
static uint8_t shown_id;
static uint8_t frame_clear; /* the frame's flag CLEAR */
static uint8_t commit;    /* the lowest number with COMMIT, if `committed` */
static bool committed;
static bool shown;
static bool waiting;      /* the oldest segment waits for the tick */
static enum state state;

void vxd_start(const struct vxd_identity *identity)
{
    self = identity;
    session = damaged = 0;
    front_digest = back_digest = 0;
    shown = waiting = false;
    shown_id = 0;
    state = EMPTY;
    ring_reset();
    vxd_clear();
    vxd_show();
    vxd_clear();
}

void vxd_disconnect(void)
{
    session = 0;
    state = EMPTY;
    shown = waiting = false;
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
    return shown ? shown_id : 0;
}

static void send_ack(uint32_t asked, uint32_t named)
{
    put_header(ACK, (shown ? SHOWN : 0U) | (state == WHOLE ? PENDING : 0U) | asked, next_number,
               frame_on_display());
    packet[3] = (uint8_t)named;
    put_u16(4, session);
    put_u16(6, self->boot);
    put_u32(8, received);
    put_u32(12, VXD_RING);
    put_u32(16, VXD_DIGEST ? front_digest : 0);
    put_u16(20, damaged);
    send_packet(22);
}

static void send_error(enum code code, uint32_t offset, uint32_t seq, uint32_t frame)
{
    put_header(ERROR, 0, seq, frame);
    packet[3] = (uint8_t)code;
    put_u16(4, session);
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
    uint32_t at;

    put_header(INFO, 0, 0, 0);
    packet[3] = 1;
    put_u16(4, of_session);
    put_u16(6, self->boot);
    packet[8] = 0;
    packet[9] = VXD_FORMAT;
    put_u16(10, VXD_NX);
    put_u16(12, VXD_NY);
    put_u16(14, VXD_NZ);
    put_u16(16, 2); /* pages, reserved */
    put_u16(18, VXD_MAX_PAYLOAD);
    put_u32(20, VXD_RING);
    put_u32(24, self->refresh);
    put_u32(28, VXD_LINE | VXD_BOX << 1 | VXD_DOTS << 2 | VXD_OCT << 3 | VXD_DIFF << 4 |
                    VXD_ARC << 5 | VXD_PALETTE << 6 | VXD_READ << 7 | VXD_DIGEST << 8);
    at = put_string(32, self->name);
    at = put_string(at, self->firmware);
    send_packet(put_string(at, self->serial));
}

static void swap(void)
{
    vxd_show();
    front_digest = back_digest;
    shown = true;
    shown_id = newest;
    state = EMPTY;
    waiting = false;
}

void vxd_tick(void)
{
    if (state == WHOLE) {
        swap();
        send_ack(0, last);
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
        session = (uint16_t)asked;
        received = 0;
        next_number = 0;
        last = newest = 255;
        shown = false;
        state = EMPTY;
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

/* Note that the packet at the distance d from the next number has been received. */
static void note_received(uint32_t d)
{
    if (d != 0) {
        received |= (uint32_t)1 << (d - 1U);
        return;
    }
    next_number++;
    while (received & 1U) {
        received >>= 1;
        next_number++;
    }
    received >>= 1;
}

static void begin_frame(uint32_t flags)
{
    newest = packet[2];
    committed = false;
    frame_clear = flags & CLEAR;
    state = FILLING;
    if (flags & CLEAR) {
        vxd_clear();
        back_digest = 0;
    } else {
        vxd_keep();
        back_digest = front_digest;
    }
}

/* How far the number of a DATA packet is ahead of the next one, modulo 256. */
static uint32_t numbers_ahead(void)
{
    return (packet[1] - (uint32_t)next_number) & 255U;
}

static bool is_duplicate(void)
{
    const uint32_t ahead = numbers_ahead();

    return ahead >= 224U || (ahead >= 1U && ahead < 32U && received >> (ahead - 1U) & 1U);
}

/* Whether the packet waits for the tick: it is of a frame behind one that is whole. */
static bool must_wait(void)
{
    return state == WHOLE && packet[0] >> 4 == DATA && packet[2] != newest && !is_duplicate();
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
    last = packet[1];
    if (duplicate) {
        send_ack(0, last);
        return OK;
    }
    *offset = 2;
    if (packet[2] == newest) {
        if (state != FILLING ||
            (committed && ((number - commit) & 255U) < 128U)) {
            return FRAME;
        }
        if ((flags & CLEAR) != frame_clear) {
            *offset = 0;
            return FRAME;
        }
    } else {
        const bool following = packet[2] == ((newest + 1U) & 255U);

        if (ahead != 0 && (state == FILLING || !following)) {
            send_ack(0, last); /* what is missing may belong to the frame before */
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
        committed = true;
        commit = (uint8_t)number;
    }
    note_received(ahead);
    if (committed && ((next_number - commit - 1U) & 255U) < 128U) {
        state = WHOLE;
        if (self->refresh == 0) {
            swap();
        }
    }
    send_ack(0, last);
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

    if (session == 0 && type != HELLO) {
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
        if (type == DATA && session != 0) {
            session = 0;
            state = EMPTY;
            shown = false;
        }
    }
}

bool vxd_poll(void)
{
    uint32_t length;

    if (ring_overrun()) {
        send_error(OVERRUN, 0, 0, 0);
    }
    if (waiting) {
        return false;
    }
    switch (ring_segment(&length)) {
    case SEGMENT_NONE:
        return false;
    case SEGMENT_PACKET:
        if (must_wait()) {
            waiting = true; /* its bytes stay in the ring, from which it is read again */
            return false;
        }
        ring_release(); /* before the response grants the room anew */
        take_packet(length);
        return true;
    case SEGMENT_DAMAGED:
        ring_release();
        damaged++;
        if (session != 0) {
            send_ack(0, last);
        }
        return true;
    default:
        ring_release();
        return true;
    }
}
