/* Configuration of the core for this sketch: what an ATmega328P has room for. */
#define VXD_NX 8
#define VXD_NY 8
#define VXD_NZ 8
#define VXD_FORMAT VXD_MONO1
#define VXD_MAX_PAYLOAD 96
#define VXD_RING 192
/* The models of the range coder need more memory than there is. */
#define VXD_ARC 0
#define VXD_ARC2 0
#define VXD_SLABS 0
