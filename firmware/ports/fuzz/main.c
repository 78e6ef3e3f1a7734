/*
 * The core against hostile bytes: the entry of libFuzzer, and without it a driver that makes random
 * sessions of valid, nearly valid and senseless packets.
 *
 *   fuzz [MEGABYTES [SEED]]
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../memory.h"

static size_t sent;

void vxd_send(uint8_t byte)
{
    (void)byte;
    sent++;
}

static const struct vxd_identity identity = {1, 30000, "fuzz", "1", ""};

/* One byte is a tick where two of FE follow each other; all others arrive. */
static void feed(const uint8_t *bytes, size_t count)
{
    vxd_start(&identity);
    for (size_t i = 0; i < count; i++) {
        vxd_receive(bytes[i]);
        if (bytes[i] == 0) {
            while (vxd_poll()) {
            }
        }
        if (i != 0 && bytes[i] == 0xFE && bytes[i - 1] == 0xFE) {
            vxd_tick();
        }
    }
}

static uint32_t check_value(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xFFFFFFFFU;

    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc & 1U ? crc >> 1 ^ 0xEDB88320U : crc >> 1;
        }
    }
    return ~crc;
}

/* Append the wire form of a packet, in the plainest COBS. */
static size_t append(uint8_t *out, size_t at, uint8_t *bytes, size_t count)
{
    uint32_t crc = check_value(bytes, count);
    size_t code = at++;

    for (int i = 0; i < 4; i++) {
        bytes[count++] = (uint8_t)(crc >> 8 * i);
    }
    for (size_t i = 0; i < count; i++) {
        if (bytes[i] != 0) {
            out[at++] = bytes[i];
        }
        if (bytes[i] == 0 || (at - code == 255U && i + 1U < count)) {
            out[code] = (uint8_t)(at - code);
            code = at++;
        }
    }
    out[code] = (uint8_t)(at - code);
    out[at++] = 0;
    return at;
}

#ifdef LIBFUZZER

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count);

/*
 * An input that begins with an even byte arrives as it is; others are packets, each behind the
 * number of its bytes, that get their check value here, which no fuzzer would find.
 */
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count)
{
    static uint8_t wire[1 << 16];
    uint8_t packet[300];
    size_t size;

    if (count == 0 || bytes[0] % 2U == 0) {
        feed(bytes, count);
        return 0;
    }
    memcpy(packet, "\x30\0\0\1\x17\x5A\0\0", 8);
    size = append(wire, 0, packet, 8);
    for (bytes++, count--; count > 1U && size < sizeof wire - 400U;) {
        size_t length = bytes[0];

        bytes++;
        count--;
        if (length > count) {
            length = count;
        }
        memset(packet, 0, 3);
        memcpy(packet, bytes, length);
        bytes += length;
        count -= length;
        size = append(wire, size, packet, length < 3U ? 3U : length);
        if (packet[1] % 8U == 7U) {
            wire[size++] = 0xFE;
            wire[size++] = 0xFE;
            wire[size++] = 0;
        }
    }
    feed(wire, size);
    return 0;
}

#else

static uint32_t state = 1;

static uint32_t random_number(uint32_t below)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state % below;
}

int main(int count, char **words)
{
    static uint8_t wire[1 << 16];
    double megabytes = count > 1 ? strtod(words[1], NULL) : 4;
    double done = 0;

    state = count > 2 ? (uint32_t)strtoul(words[2], NULL, 0) | 1U : 1U;
    while (done < 1e6 * megabytes) {
        size_t size = 0;
        uint32_t number = 0;
        uint32_t frame = 0;

        while (size < 40000U) {
            uint8_t packet[400] = {0};
            size_t length = 3;
            uint32_t kind = random_number(16);

            if (kind < 4U || size == 0) { /* often: a refusal ends the session */
                memcpy(packet, "\x30\0\0\1\x17\x5A\0\0", 8);
                length = 8;
                number = frame = 0;
            } else if (kind < 12U) {
                packet[0] = (uint8_t)(0x10U | (random_number(4) ? 1U : 0U) |
                                      (random_number(3) ? 0U : 4U));
                packet[1] = (uint8_t)(number++ + (random_number(12) ? 0U : random_number(40)));
                packet[2] = (uint8_t)frame;
                frame += packet[0] >> 2 & 1U;
                for (uint32_t n = random_number(random_number(4) ? 24 : 260); n != 0; n--) {
                    packet[length++] =
                        (uint8_t)(random_number(3) ? random_number(8) : random_number(256));
                }
                if (random_number(4) == 0) {
                    packet[3] = (uint8_t)(0x58U + random_number(3));
                }
            } else if (kind == 12U) {
                packet[0] = 0x40;
            } else if (kind == 13U) {
                packet[0] = (uint8_t)(0x50U | random_number(2));
                packet[4] = (uint8_t)random_number(256);
                packet[8] = (uint8_t)random_number(256);
                packet[9] = (uint8_t)random_number(3);
                length = 12;
            } else {
                for (uint32_t n = random_number(300); n != 0; n--) {
                    packet[length++] = (uint8_t)random_number(256);
                }
            }
            size = append(wire, size, packet, length);
            if (random_number(6) == 0) {
                wire[size++] = 0xFE;
                wire[size++] = 0xFE;
                wire[size++] = 0;
            }
            if (size > 20U && random_number(40) == 0) {
                wire[size - 1U - random_number(20)] ^= (uint8_t)(1U << random_number(8));
            }
        }
        feed(wire, size);
        done += (double)size;
    }
    printf("%.0f bytes in, %zu bytes out\n", done, sent);
    return 0;
}

#endif
