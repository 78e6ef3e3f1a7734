/*
 * A device of the voxdisplay protocol: the public interface of the core.
 *
 * The core is freestanding C11: no heap, no file, no clock, and of the C library memcpy and memset
 * alone. The maker of a display sets the macros below, implements the functions under "The maker's
 * functions" and calls those under "The core's functions". Sections are those of protocol.md.
 */
#ifndef VOXEL_DEVICE_H
#define VOXEL_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

/* ---- Configuration: define what differs on the compiler's command line -------------------- */

#define VXD_MONO1 1
#define VXD_INDEX8 2
#define VXD_RGB565 3
#define VXD_RGB888 4

/* Or in a file of this name, where a build has no command line of one's own. */
#ifdef __has_include
#if __has_include("voxel_device_config.h")
#include "voxel_device_config.h"
#endif
#endif

#ifndef VXD_NX
#define VXD_NX 16
#endif
#ifndef VXD_NY
#define VXD_NY 16
#endif
#ifndef VXD_NZ
#define VXD_NZ 16
#endif
#ifndef VXD_FORMAT
#define VXD_FORMAT VXD_RGB888
#endif
/* Longest payload of a packet, in bytes: 64 to 65535. INFO with its strings must fit. */
#ifndef VXD_MAX_PAYLOAD
#define VXD_MAX_PAYLOAD 256
#endif
/* The credit (section 9.2). The receive ring is that, rounded up to a power of two. */
#ifndef VXD_RING
#define VXD_RING 1024
#endif

/*
 * Features: 1 with, 0 without. DIFF and PALETTE need VXD_INDEX8, FADE anything but VXD_MONO1; HOLD is
 * announced only by a device that has refresh ticks.
 */
#ifndef VXD_LINE
#define VXD_LINE 1
#endif
#ifndef VXD_BOX
#define VXD_BOX 1
#endif
#ifndef VXD_DOTS
#define VXD_DOTS 1
#endif
#ifndef VXD_OCT
#define VXD_OCT 1
#endif
#ifndef VXD_DIFF
#define VXD_DIFF (VXD_FORMAT == VXD_INDEX8)
#endif
#ifndef VXD_ARC
#define VXD_ARC 1
#endif
#ifndef VXD_ARC2
#define VXD_ARC2 1
#endif
#ifndef VXD_SLABS
#define VXD_SLABS 1
#endif
#ifndef VXD_FADE
#define VXD_FADE (VXD_FORMAT != VXD_MONO1)
#endif
#ifndef VXD_HOLD
#define VXD_HOLD 1
#endif
#ifndef VXD_PALETTE
#define VXD_PALETTE (VXD_FORMAT == VXD_INDEX8)
#endif
#ifndef VXD_READ
#define VXD_READ 1
#endif
#ifndef VXD_DIGEST
#define VXD_DIGEST 1
#endif

/* A table of 64 bytes makes the check value twice as fast. */
#ifndef VXD_CRC_TABLE
#define VXD_CRC_TABLE 1
#endif

/* Keep the receive interrupt from running, and let it run again. */
#ifndef VXD_LOCK
#define VXD_LOCK() ((void)0)
#define VXD_UNLOCK() ((void)0)
#endif

#define VXD_VOXELS ((uint32_t)VXD_NX * (uint32_t)VXD_NY * (uint32_t)VXD_NZ)

/* ---- The maker's functions ---------------------------------------------------------------- */

/*
 * There are two pages, front and back. A voxel's index is x + nx * (y + ny * z); its value is that
 * of section 2.1. All indices that the core passes are below VXD_VOXELS.
 */

/* Make the back page dark, with the default palette. */
void vxd_clear(void);

/* Write one voxel of the back page. */
void vxd_put(uint32_t index, uint32_t value);

/* Exchange front and back page, between two refreshes. */
void vxd_show(void);

/* Make the back page a copy of the front page, with its palette. */
void vxd_keep(void);

#if VXD_READ || VXD_DIGEST
/* Return the value of one voxel, of the back page or of the front page. */
uint32_t vxd_get(bool back, uint32_t index);
#endif

#if VXD_PALETTE
/* Set and return one entry of the back page's palette: red + 256 green + 65536 blue. */
void vxd_put_color(uint8_t entry, uint32_t color);
uint32_t vxd_get_color(uint8_t entry);
#endif

/* Send one byte to the host. It may block; it must not call the core. */
void vxd_send(uint8_t byte);

/* ---- The core's functions ----------------------------------------------------------------- */

/* What INFO says beside the configuration. The strings must outlive the device. */
struct vxd_identity {
    uint16_t boot;    /* another number, as far as possible, after each start */
    uint32_t refresh; /* ticks per 1000 seconds; 0: a swap happens at once */
    const char *name; /* shortened if INFO would become too long */
    const char *firmware;
    const char *serial;
};

/* Start the device, or start it again: no session, dark pages, an empty ring. */
void vxd_start(const struct vxd_identity *identity);

/* Take one byte of the host. An interrupt routine may call it. */
void vxd_receive(uint8_t byte);

/* Take one packet from the ring; return false if there was nothing to do. */
bool vxd_poll(void);

/* Note a refresh tick. Call it between two calls of vxd_poll, never from an interrupt. */
void vxd_tick(void);

/* End the session: the carrier's connection has ended (section 16). */
void vxd_disconnect(void);

/* Return a colour of the default palette: red + 256 green + 65536 blue. */
uint32_t vxd_default_color(uint8_t entry);

#endif
