/* Packets on the wire: check value, COBS, little-endian numbers (sections 3 and 4). */
#include "internal.h"

uint8_t packet[LONGEST_PACKET + 1U];

uint32_t crc32(const uint8_t *bytes, uint32_t count)
{
    /* The polynomial is that of section 4, its bits reversed. */
#if VXD_CRC_TABLE
    /* The remainders of four bits. */
    static const uint32_t remainder[16] = {
        0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U,
        0x4DB26158U, 0x5005713CU, 0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU,
        0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU};
#endif
    uint32_t crc = 0xFFFFFFFFU;

    for (; count != 0; count--) {
        crc ^= *bytes++;
#if VXD_CRC_TABLE
        crc = (crc >> 4) ^ remainder[crc & 15U];
        crc = (crc >> 4) ^ remainder[crc & 15U];
#else
        for (uint32_t bit = 0; bit < 8U; bit++) {
            crc = crc & 1U ? crc >> 1 ^ 0xEDB88320U : crc >> 1;
        }
#endif
    }
    return ~crc;
}

void put_u16(uint32_t at, uint32_t value)
{
    packet[at] = (uint8_t)value;
    packet[at + 1U] = (uint8_t)(value >> 8);
}

void put_u32(uint32_t at, uint32_t value)
{
    put_u16(at, value);
    put_u16(at + 2U, value >> 16);
}

uint32_t get_u16(const uint8_t *bytes)
{
    return bytes[0] | (uint32_t)bytes[1] << 8;
}

uint32_t get_u32(const uint8_t *bytes)
{
    return get_u16(bytes) | get_u16(bytes + 2) << 16;
}

void send_packet(uint32_t length)
{
    const uint8_t *at = packet;
    const uint8_t *const end = packet + length + 4U;
    uint32_t size;

    put_u32(length, crc32(packet, length));
    packet[length + 4U] = 0; /* ends the last group as any other */
    do {
        for (size = 0; size != 254U && at[size] != 0; size++) {
        }
        vxd_send((uint8_t)(size + 1U));
        for (uint32_t i = 0; i != size; i++) {
            vxd_send(*at++);
        }
        if (size != 254U) {
            at++; /* the 00 is implied */
        }
    } while (at < end || (at == end && size != 254U));
    vxd_send(0);
}
