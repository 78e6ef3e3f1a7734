/* Two pages in plain memory: the maker's functions for a port that has the room. */
#include <string.h>

#include "memory.h"

#define BYTES (VXD_FORMAT <= VXD_INDEX8 ? 1U : (uint32_t)VXD_FORMAT - 1U)

static uint8_t pages[2][VXD_VOXELS * BYTES];
static uint32_t front;
static uint8_t *back_page = pages[1]; /* at hand: each voxel is written there */
#if VXD_PALETTE
static uint32_t palettes[2][256];
#endif

void vxd_clear(void)
{
    memset(back_page, 0, sizeof pages[0]);
#if VXD_PALETTE
    for (uint32_t i = 0; i < 256U; i++) {
        palettes[1U - front][i] = vxd_default_color((uint8_t)i);
    }
#endif
}

void vxd_put(uint32_t index, uint32_t value)
{
    uint8_t *at = &back_page[index * BYTES];

    for (uint32_t i = 0; i < BYTES; i++, value >>= 8) {
        at[i] = (uint8_t)value;
    }
}

void vxd_show(void)
{
    back_page = pages[front];
    front = 1U - front;
}

void vxd_keep(void)
{
    memcpy(back_page, pages[front], sizeof pages[0]);
#if VXD_PALETTE
    memcpy(palettes[1U - front], palettes[front], sizeof palettes[0]);
#endif
}

#if VXD_READ || VXD_DIGEST
uint32_t vxd_get(bool back, uint32_t index)
{
    const uint8_t *at = &(back ? back_page : pages[front])[index * BYTES];
    uint32_t value = 0;

    for (uint32_t i = 0; i < BYTES; i++) {
        value |= (uint32_t)at[i] << 8U * i;
    }
    return value;
}
#endif

#if VXD_PALETTE
void vxd_put_color(uint8_t entry, uint32_t color)
{
    palettes[1U - front][entry] = color;
}

uint32_t vxd_get_color(uint8_t entry)
{
    return palettes[1U - front][entry];
}
#endif

const uint8_t *memory_front(uint32_t *size)
{
    *size = sizeof pages[0];
    return pages[front];
}
