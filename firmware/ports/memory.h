/* Two pages in plain memory. */
#ifndef VXD_MEMORY_H
#define VXD_MEMORY_H

#include "voxel_device.h"

/* The front page, voxel by voxel in scan order, each with the bytes of its pixel. */
const uint8_t *memory_front(uint32_t *size);

#endif
